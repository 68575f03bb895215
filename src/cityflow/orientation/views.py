"""What one image sees of the ground: its footprint, its ground sampling distance, and which points lie in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import Camera, OrientedImage

REACH = 6.0
"""Footprints end at this multiple of the flying height, measured horizontally from the camera."""
STEPS_PER_SIDE = 12
"""Border points on each side of an image; straight sides need no more than their ends, but distorted ones bend."""


@dataclass(frozen=True, slots=True)
class View:
    """An image, and the heights of what it looks at.

    Attributes
    ----------
    image : camera and orientation
    heights : lowest ground and highest object seen, world metres
    """

    image: OrientedImage
    heights: tuple[float, float]

    @property
    def name(self) -> str:
        return self.image.name


def footprint(view: View, height: float | None = None, reach: float = REACH) -> shapely.Polygon:
    """What the image covers of a level plane.

    Parameters
    ----------
    view : the image
    height : of the plane, world metres; the lowest ground if None
    reach : rays at or above the horizon, and those that meet the plane too far away, end at this multiple of the flying height

    Returns
    -------
    Polygon, world metres; empty where the camera is not above the plane or looks nowhere down.
    """
    return footprints([view], None if height is None else np.array([height]), reach)[0]


def footprints(views: Sequence[View], heights: FloatArray | None = None, reach: float = REACH) -> list[shapely.Polygon]:
    """`footprint` of many views: (N,) polygons at (N,) heights, world metres, computed camera by camera."""
    planes = np.array([v.heights[0] for v in views]) if heights is None else np.asarray(heights, np.float64)
    result: list[shapely.Polygon] = [shapely.Polygon()] * len(views)
    by_camera: dict[Camera, list[int]] = {}
    for i, view in enumerate(views):
        by_camera.setdefault(view.image.camera, []).append(i)
    for camera, members in by_camera.items():
        border = _border(camera)
        rays = border @ np.array([views[i].image.rotation for i in members])
        centres = np.array([views[i].image.centre for i in members])
        above = centres[:, 2] - planes[members]
        plain = (above > 0) & np.all(-rays[..., 2] * reach > np.hypot(rays[..., 0], rays[..., 1]), axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            ground = centres[:, None, :2] + rays[..., :2] * (above[:, None] / -rays[..., 2])[..., None]
        whole = iter(shapely.polygons(ground[plain]))
        for k, i in enumerate(members):
            result[i] = next(whole) if plain[k] else _cut(rays[k], centres[k, :2], float(above[k]), reach)
    return result


def gsd(view: View) -> float:
    """Ground sampling distance where the optical axis meets the lowest ground, metres per pixel across the ray; infinite where it does not."""
    image = view.image
    above, down = float(image.centre[2]) - view.heights[0], -float(image.axis[2])
    if above <= 0 or down <= 1e-9:
        return float("inf")
    return above / down / float(np.sqrt(image.camera.fx * image.camera.fy))


def sees(image: OrientedImage, xyz: FloatArray, margin_px: float = 0.0) -> BoolArray:
    """Which (..., 3) world points lie in the image (whatever may stand before them), at least `margin_px` from its border.

    Points far outside, which the polynomials of a distortion could fold back into the image, are told by their direction.
    """
    return _in_frame(image, image.in_camera(xyz), margin_px)


def sees_each(images: Sequence[OrientedImage], xyz: FloatArray) -> BoolArray:
    """`sees` of many images: (m, n) for (n, 3) world points, computed camera by camera."""
    seen = np.zeros((len(images), len(xyz)), bool)
    by_camera: dict[Camera, list[int]] = {}
    for i, image in enumerate(images):
        by_camera.setdefault(image.camera, []).append(i)
    for members in by_camera.values():
        centres = np.array([images[i].centre for i in members])
        rotations = np.array([images[i].rotation for i in members])
        local = (xyz - centres[:, None, :]) @ rotations.transpose(0, 2, 1)
        seen[members] = _in_frame(images[members[0]], local, 0.0)
    return seen


def _in_frame(image: OrientedImage, local: FloatArray, margin_px: float) -> BoolArray:
    """Which (..., 3) points of the camera frame lie in the image; of the image, only its camera is asked."""
    depth = np.where(local[..., 2] > 1e-9, local[..., 2], np.nan)
    normal = local[..., :2] / depth[..., None]
    low, high = _extent(image.camera)
    x, y = normal[..., 0], normal[..., 1]
    near = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1])
    uv = image.camera.distort(np.where(near[..., None], normal, 0.0))
    return np.asarray(near & image.holds(uv, margin_px))


def field_of_view(camera: Camera) -> tuple[FloatArray, FloatArray]:
    """Least and largest x/z, y/z of a camera's rays, each (2,), with a little room."""
    return _extent(camera)


def border_rays(camera: Camera, steps: int = STEPS_PER_SIDE) -> FloatArray:
    """(4 · steps, 3) rays through the border in the camera frame, depth 1, clockwise in the image."""
    w, h = float(camera.width), float(camera.height)
    t = np.arange(steps)[:, None] / steps
    corners = np.array([[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]])
    uv = np.concatenate([a + t * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
    return np.column_stack([camera.undistort(uv), np.ones(len(uv))])


@lru_cache(maxsize=4096)
def _border(camera: Camera) -> FloatArray:
    """Straight sides need no more than their ends."""
    return border_rays(camera, 1 if camera.is_pinhole else STEPS_PER_SIDE)


@lru_cache(maxsize=4096)
def _extent(camera: Camera) -> tuple[FloatArray, FloatArray]:
    """Least and largest x/z, y/z along the border, with a little room."""
    border = _border(camera)[:, :2]
    room = 0.01 * np.ptp(border, axis=0)
    return border.min(axis=0) - room, border.max(axis=0) + room


def _cut(rays: FloatArray, centre: FloatArray, above: float, reach: float) -> shapely.Polygon:
    """Footprint of a view that touches the horizon: its rays cut below the horizon, then its ground by a disc."""
    if above <= 0:
        return shapely.Polygon()
    size = float(np.linalg.norm(rays, axis=1).max())
    kept = _below(rays, -1e-3 * size / reach)
    if len(kept) < 3:
        return shapely.Polygon()
    ground = centre + kept[:, :2] * (above / -kept[:, 2])[:, None]
    disc = shapely.Point(centre).buffer(reach * above, quad_segs=32)
    part = shapely.make_valid(shapely.Polygon(ground)).intersection(disc)
    pieces = [g for g in shapely.get_parts(part) if g.geom_type == "Polygon"]
    return max(pieces, key=lambda g: g.area, default=shapely.Polygon())


def _below(rays: FloatArray, limit: float) -> FloatArray:
    """The part of a closed chain of rays with z <= limit (Sutherland and Hodgman's clipping by one plane)."""
    kept = []
    for a, b in zip(rays, np.roll(rays, -1, axis=0), strict=True):
        if a[2] <= limit:
            kept.append(a)
        if (a[2] <= limit) != (b[2] <= limit):
            kept.append(a + (limit - a[2]) / (b[2] - a[2]) * (b - a))
    return np.array(kept).reshape(-1, 3)
