"""Façades, roofs, ground and trees as points from images, with known places."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.depth_map import ImagePoints

GSD_M = 0.08
AWAY_M = 300.0
"""Reference images stand so far off and as high: they look down at 45 degrees."""
ORIGIN = np.array([85_000.0, 447_000.0])
DIRECTIONS = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))

Part = tuple[FloatArray, FloatArray]
"""(N, 3) points, and the centre of the image that they come from."""


def camera(outward: FloatArray, at: FloatArray) -> FloatArray:
    """An image that looks at a place from the side of `outward`."""
    return np.array([at[0] + AWAY_M * outward[0], at[1] + AWAY_M * outward[1], AWAY_M])


def facade(
    rng: np.random.Generator, a: FloatArray, b: FloatArray, heights: tuple[float, float], noise_m: float = 0.06
) -> Part:
    """A wall from a to b (metres from `ORIGIN`), seen from the right of the way; noise lies along the rays."""
    along = (b - a) / np.hypot(*(b - a))
    outward = np.array([along[1], -along[0]])
    s = np.arange(0.5 * GSD_M, np.hypot(*(b - a)), GSD_M)
    z = np.arange(heights[0], heights[1], GSD_M * np.sqrt(2))
    s, z = (v.ravel() for v in np.meshgrid(s, z))
    xyz = np.column_stack([ORIGIN + a + s[:, None] * along, z])
    centre = camera(outward, ORIGIN + (a + b) / 2)
    return _noisy(rng, xyz, centre, noise_m), centre


def ring(
    rng: np.random.Generator,
    corners: Sequence[tuple[float, float]],
    heights: tuple[float, float],
    noise_m: float = 0.06,
) -> list[Part]:
    """Walls around a building; corners counter-clockwise."""
    xy = np.asarray(corners, np.float64)
    return [facade(rng, a, b, heights, noise_m) for a, b in zip(xy, np.roll(xy, -1, axis=0), strict=True)]


def level(rng: np.random.Generator, box: tuple[float, float, float, float], height: float, slope: float = 0.0) -> Part:
    """Ground or a roof that rises eastwards."""
    x, y = np.meshgrid(np.arange(box[0], box[2], GSD_M), np.arange(box[1], box[3], GSD_M))
    xyz = np.column_stack([x.ravel() + ORIGIN[0], y.ravel() + ORIGIN[1], height + slope * (x.ravel() - box[0])])
    centre = camera(np.array([1.0, 0.0]), ORIGIN)
    return _noisy(rng, xyz, centre, 0.05), centre


def tree(
    rng: np.random.Generator, x: float, y: float, radius: float = 2.0, top: float = 8.0, count: int = 6000
) -> Part:
    """Leaves in a shell of a metre, as images from one side see them."""
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    way[:, :2] *= np.where(way[:, :1] < 0, -1.0, 1.0)
    xyz = np.array([ORIGIN[0] + x, ORIGIN[1] + y, top - radius]) + way * (radius - rng.random((count, 1)))
    return xyz, camera(np.array([1.0, 0.0]), ORIGIN + np.array([x, y]))


def image_points(parts: Sequence[Part]) -> ImagePoints:
    """One cloud; every part comes from an image of its own."""
    xyz = np.concatenate([p for p, _ in parts])
    image = np.repeat(np.arange(len(parts)), [len(p) for p, _ in parts])
    n = len(xyz)
    return ImagePoints(
        xyz, np.zeros((n, 3), np.uint8), image, np.full(n, 2, np.uint8), np.full(n, 0.06, np.float32),
        tuple(f"i{k}" for k in range(len(parts))), np.array([c for _, c in parts]),
    )  # fmt: skip


def _noisy(rng: np.random.Generator, xyz: FloatArray, centre: FloatArray, noise_m: float) -> FloatArray:
    ray = centre - xyz
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    return np.asarray(xyz + ray * rng.normal(0.0, noise_m, len(xyz))[:, None])
