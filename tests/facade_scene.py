"""Painted panels in space as cameras see them: every pixel's rays are followed to the nearest panel, exactly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.building import Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.pixels import ArrayPixels
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceGrid, FacePlane, FaceView, SeenFace

SKY = np.array([250.0, 20.0, 250.0])
"""No panel has a colour like it."""
Paint = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Panel:
    face: FacePlane
    paint: Paint


def plane(rings: Sequence[np.ndarray], index: int = 0, semantic: Semantic = Semantic.WALL) -> FacePlane:
    """A face's frame from its rings; of walls `up` is vertical, of level faces north."""
    rings = tuple(np.asarray(r, np.float64) for r in rings)
    ring = rings[0]
    normal = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
    normal /= np.linalg.norm(normal)
    up = np.array([0.0, 1.0, 0.0]) if abs(normal[2]) > 0.9999 else np.array([0.0, 0.0, 1.0])
    up = up - normal * (up @ normal)
    up /= np.linalg.norm(up)
    right = np.cross(up, normal)
    flat = [np.column_stack([(r - ring[0]) @ right, (r - ring[0]) @ up]) for r in rings]
    return FacePlane(("solid", index), semantic, rings, ring[0], right, up, normal, shapely.Polygon(flat[0], flat[1:]))


def wall(width: float = 15.0, height: float = 10.0, index: int = 0) -> FacePlane:
    """A façade that looks south, its foot on y = 0."""
    return plane([np.array([[0, 0, 0], [width, 0, 0], [width, 0, height], [0, 0, height]])], index)


def storeys(st: np.ndarray) -> np.ndarray:
    """(N, 3) a façade: soft stains and dark windows."""
    s, t = st[:, 0], st[:, 1]
    stain = 18 * np.sin(0.9 * s) * np.cos(0.7 * t) + 9 * np.sin(3.1 * s + 1.3 * t)
    window = (np.abs((s % 3.0) - 1.5) < 0.6) & (np.abs((t % 3.3) - 1.7) < 0.8)
    base = np.column_stack([165 + stain, 125 + 0.8 * stain, 90 + 0.6 * stain])
    return np.where(window[:, None], np.array([45.0, 55.0, 70.0]), base)


def plain(*colour: float) -> Paint:
    return lambda st: np.broadcast_to(np.array(colour), (len(st), 3))


def photograph(panels: Sequence[Panel], image: OrientedImage, samples: int = 2) -> np.ndarray:
    """(rows, cols, 3) float64 colours."""
    camera = image.camera
    v, u = np.mgrid[: camera.height, : camera.width]
    total = np.zeros((camera.height * camera.width, 3))
    steps = (np.arange(samples) + 0.5) / samples
    for du in steps:
        for dv in steps:
            rays = image.rays(np.column_stack([u.ravel() + du, v.ravel() + dv]))
            total += _seen_colours(panels, image.centre, rays)
    return (total / samples**2).reshape(camera.height, camera.width, 3)


def _seen_colours(panels: Sequence[Panel], centre: np.ndarray, rays: np.ndarray) -> np.ndarray:
    colours, far = np.tile(SKY, (len(rays), 1)), np.full(len(rays), np.inf)
    for panel in panels:
        face = panel.face
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = ((face.origin - centre) @ face.normal) / (rays @ face.normal)
        near = np.flatnonzero((distance > 1e-6) & (distance < far))
        st = face.on_plane(centre + distance[near, None] * rays[near])
        hit = shapely.intersects_xy(face.polygon, st[:, 0], st[:, 1])
        far[near[hit]] = distance[near[hit]]
        colours[near[hit]] = panel.paint(st[hit])
    return colours


def sees(panels: Sequence[Panel], face: FacePlane, image: OrientedImage, xyz: np.ndarray) -> np.ndarray:
    """(N,) bool: which points of a face are in the frame and behind no other panel."""
    uv, depth = image.project(xyz)
    clear = (depth > 0) & image.holds(uv)
    for panel in panels:
        if panel.face.key == face.key:
            continue
        other = panel.face
        rays = xyz - image.centre
        with np.errstate(divide="ignore", invalid="ignore"):
            along = ((other.origin - image.centre) @ other.normal) / (rays @ other.normal)
        st = other.on_plane(image.centre + np.where(np.isfinite(along), along, 0.0)[:, None] * rays)
        clear &= ~((along > 0) & (along < 1 - 1e-9) & shapely.intersects_xy(other.polygon, st[:, 0], st[:, 1]))
    return clear


def looking_at(
    name: str, centre: Sequence[float], target: Sequence[float], camera: Camera | None = None
) -> OrientedImage:
    """A level camera with its axis through the target."""
    axis = np.asarray(target, np.float64) - centre
    axis /= np.linalg.norm(axis)
    right = np.cross(axis, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(axis, right), axis])
    return OrientedImage(name, camera or Camera(400, 300, 900.0, 900.0, 200.0, 150.0), rotation, np.array(centre))


def view_of(face: FacePlane, image: OrientedImage, index: int) -> FaceView:
    """Worst of the vertices' pixel sizes on the face."""
    ring = face.rings[0]
    uv, _ = image.project(ring)
    rays = image.rays(np.concatenate([uv + d for d in ([-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5])]))
    met = face.on_plane(
        image.centre + (((face.origin - image.centre) @ face.normal) / (rays @ face.normal))[:, None] * rays
    )
    a, b, c, d = met.reshape(4, -1, 2)
    area = 0.5 * np.abs((c - a)[:, 0] * (d - b)[:, 1] - (c - a)[:, 1] * (d - b)[:, 0])
    ray = ring.mean(axis=0) - image.centre
    angle = np.degrees(np.arccos(abs(ray @ face.normal) / np.linalg.norm(ray)))
    inside = float(image.holds(uv).mean())
    return FaceView(index, float(np.sqrt(area.max())), float(angle), inside)


def seen_face(panels: Sequence[Panel], face: FacePlane, image: OrientedImage, index: int, grid: FaceGrid) -> SeenFace:
    st = grid.centres().reshape(-1, 2)
    mask = sees(panels, face, image, face.world(st)) & shapely.intersects_xy(face.polygon, st[:, 0], st[:, 1])
    return SeenFace(view_of(face, image, index), RunLengthMask.of(mask.reshape(grid.rows, grid.cols)))


def as_pixels(colours: np.ndarray, gain: float = 1.0, offset: float = 0.0, dtype: type = np.uint8) -> ArrayPixels:
    top = np.iinfo(dtype).max
    return ArrayPixels(np.clip(np.rint(colours * gain + offset), 0, top).astype(dtype))
