"""A small town of known heights, and the points that depth maps of it would give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter

from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import DepthMap, ImagePoints, joined, world_points
from cityflow.core.grid import Grid

SIZE = 24.0
CAMERA_M = 400.0
GREEN, GREY, RED = (70, 110, 50), (120, 120, 122), (150, 80, 60)
OBLIQUE = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Sloping ground, a flat block of 6 m, a gable house of 5 m to the eaves, and a crown with a rough top."""
    z, of = 0.03 * x - 0.02 * y, part(x, y)
    roof = of == 2
    block = (x > 3) & (x < 9) & roof
    z = np.where(block, 6.5, z)
    z = np.where(roof & ~block, 8.0 - 0.8 * np.abs(y - 7.0), z)
    far = np.hypot(x - 18, y - 18)
    crown = 5 + np.sqrt(np.maximum(9 - far**2, 0)) + 0.4 * np.sin(5 * x) * np.sin(5 * y)
    return np.where(of == 7, crown, z)


def part(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """0 ground, 2 roof, 7 crown."""
    block = (x > 3) & (x < 9) & (y > 12) & (y < 21)
    house = (x > 5) & (x < 19) & (y > 3) & (y < 11)
    return np.where(block | house, 2, np.where(np.hypot(x - 18, y - 18) < 2.9, 7, 0))


def depth_points(
    name: str, lean: tuple[float, float], gsd: float, noise: float, rng: np.random.Generator, blunders: float = 0.0
) -> ImagePoints:
    """Points of one view along the direction (lean east, lean north, -1), with errors that neighbouring pixels share in part."""
    down = np.array([*lean, -1.0])
    step = gsd * np.hypot(1, np.hypot(*lean))
    axis = np.arange(-14, SIZE + 14, gsd)
    x_0, y_0 = np.meshgrid(axis, axis)
    # each ray starts 12 m up, over its place at height 0, and goes down in steps until it is below the surface
    x_0, y_0 = x_0 - 12 * lean[0], y_0 - 12 * lean[1]
    t = np.zeros(x_0.shape)
    passes = np.ones(t.shape, bool)  # over the town, wherever it ends; others are left out below
    for start, way in ((x_0, lean[0]), (y_0, lean[1])):
        ends = np.sort([start - 8 * way, start + 25 * way], axis=0)
        passes &= (ends[1] >= 0) & (ends[0] <= SIZE)
    for stride in (0.2, 0.02):
        t = np.maximum(t - stride * 10, 0) if stride < 0.2 else t
        above = passes.copy()
        for _ in range(round(16 / 0.2)):
            on = t[above]
            is_above = 12 - on > height(x_0[above] + on * lean[0], y_0[above] + on * lean[1])
            if not is_above.any():
                break
            t[above] = np.where(is_above, on + stride, on)
            above[above] = is_above
    shared = gaussian_filter(rng.normal(size=t.shape), 1.5)
    error = noise * (0.6 * rng.normal(size=t.shape) + 0.8 * shared / shared.std())
    wild = rng.random(t.shape) < blunders
    t = t - 0.01 + error / step * gsd + np.where(wild, rng.uniform(-6, 6, t.shape), 0)
    xyz = np.column_stack([(x_0 + t * lean[0]).ravel(), (y_0 + t * lean[1]).ravel(), (12 - t).ravel()])
    inside = (xyz[:, 0] >= 0) & (xyz[:, 0] < SIZE) & (xyz[:, 1] >= 0) & (xyz[:, 1] < SIZE)
    xyz = xyz[inside]
    of = np.array([GREY, GREY, RED, GREY, GREY, GREY, GREY, GREEN], np.uint8)[part(xyz[:, 0], xyz[:, 1])]
    n = len(xyz)
    centre = np.array([[SIZE / 2, SIZE / 2, 0.0]]) - CAMERA_M * down
    sigma = np.full(n, noise, np.float32)
    return ImagePoints(xyz, of, np.zeros(n, np.int64), np.full(n, 2, np.uint8), sigma, (name,), centre)


def flight(seed: int, gsd: float = 0.2, noise: float = 0.1, blunders: float = 0.01) -> ImagePoints:
    """Two views from above and four obliques."""
    rng = np.random.default_rng(seed)
    leans: Sequence[tuple[float, float]] = ((0.1, 0.05), (-0.08, -0.12), *OBLIQUE)
    return joined([depth_points(f"view {i}", lean, gsd, noise, rng, blunders) for i, lean in enumerate(leans)])


def points_of(depth_map: DepthMap, image: OrientedImage) -> ImagePoints:
    """All pixels with a depth as world points, row by row; without colour where the map has none."""
    pixel, xyz = world_points(depth_map.depth, (depth_map.row, depth_map.col), image)
    bands = depth_map.colour.shape[-1]
    colour = depth_map.colour.reshape(-1, bands).take(pixel, axis=0) if bands else np.empty((len(xyz), 0), np.uint8)
    return ImagePoints(
        xyz, colour, np.zeros(len(xyz), np.int64), depth_map.views.take(pixel), depth_map.sigma.take(pixel), (image.name,),
        image.centre[None, :],
    )  # fmt: skip


def rotated(points: ImagePoints, frame_from_world: np.ndarray, origin: np.ndarray) -> ImagePoints:
    """The same points in a frame whose coordinates are frame_from_world · (world - origin)."""
    xyz, centres = ((v - origin) @ frame_from_world.T for v in (points.xyz, points.centres))
    return replace(points, xyz=xyz, centres=centres)


def moved(points: ImagePoints, east: float, north: float, up: float) -> ImagePoints:
    """The same town elsewhere."""
    return rotated(points, np.eye(3), np.array([-east, -north, -up]))


def truth(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Heights and parts at the centres."""
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    return height(x, y), part(x, y)
