"""What an image has in its frame above the ground: photographs that look level at a house have no footprint, and yet they show it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import GeometryType

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.orientation.views import REACH, View, border_rays

HORIZON_DEG = 85.0
"""An axis tilted more sees ground only far away; set by hand, as are those below."""
NEAR_M = 150.0
"""Photographs from the street show houses so far away, however low they were taken."""


def looks_level(image: OrientedImage, highest: float) -> bool:
    """Whether an image was taken among the houses and looks at their walls: below the highest object and not at the ground.

    Such an image is a source of textures; nothing is matched with it.
    """
    return bool(np.degrees(image.tilt) > HORIZON_DEG and image.centre[2] < highest)


def sights(views: Sequence[View], reach: float = REACH, near_m: float = NEAR_M) -> list[shapely.Polygon]:
    """Plan of all that images have in their frame between the heights they look at.

    Parameters
    ----------
    reach, near_m : nothing is farther from a camera than this multiple of its height above the lowest ground, or than so many metres

    Returns
    -------
    (N,) polygons, world metres; empty where an image looks past all of it.
    """
    found: list[shapely.Polygon] = [shapely.Polygon()] * len(views)
    by_camera: dict[Camera, list[int]] = {}
    for i, view in enumerate(views):
        by_camera.setdefault(view.image.camera, []).append(i)
    for camera, members in by_camera.items():
        rays = border_rays(camera) @ np.array([views[i].image.rotation for i in members])
        centres = np.array([views[i].image.centre for i in members])
        heights = np.array([views[i].heights for i in members])
        farthest = np.maximum(reach * (centres[:, 2] - heights[:, 0]), near_m)
        places, owner = _ends(rays, centres, heights, farthest)
        # as lines: points of a city's images would be millions of objects
        shapes = shapely.convex_hull(shapely.linestrings(places, indices=owner)) if len(owner) else np.empty(0, object)
        shapes[shapely.get_type_id(shapes) != GeometryType.POLYGON] = shapely.Polygon()
        for k, shape in zip(np.unique(owner).tolist(), shapes.tolist(), strict=True):
            found[members[k]] = shape
    return found


def _ends(rays: FloatArray, centres: FloatArray, heights: FloatArray, farthest: FloatArray) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """(M, 2) places where rays enter and leave what lies between two heights, and the (M,) image of each, ascending."""
    with np.errstate(divide="ignore", invalid="ignore"):
        crossings = (heights - centres[:, 2:])[:, None, :] / rays[..., 2:]
        last = farthest[:, None] / np.hypot(rays[..., 0], rays[..., 1])
    level = rays[..., 2] == 0.0
    between = (centres[:, 2] > heights[:, 0]) & (centres[:, 2] < heights[:, 1])
    first = np.where(level, np.where(between[:, None], 0.0, np.inf), np.maximum(crossings.min(axis=-1), 0.0))
    last = np.minimum(np.where(level, np.inf, crossings.max(axis=-1)), last)
    image, ray = np.nonzero(first <= last)
    steps = np.column_stack([first[image, ray], last[image, ray]])
    places = centres[image, None, :2] + steps[..., None] * rays[image, ray, None, :2]
    return places.reshape(-1, 2), np.repeat(image, 2)
