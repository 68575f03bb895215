"""Small roofs with known planes, scanned at random places."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from shapely import Polygon, box

from cityflow.core.arrays import FloatArray
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence

Height = Callable[[FloatArray, FloatArray], FloatArray]
ORIGIN = (84_900.0, 447_500.0, 2.0)


def scan(height: Height, outline: Polygon, density: float, noise: float, seed: int) -> Evidence:
    """Points of a roof given over a local outline, in the world frame."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = outline.bounds
    count = int(density * (x1 - x0) * (y1 - y0))
    x, y = rng.uniform(x0, x1, count), rng.uniform(y0, y1, count)
    z = height(x, y) + rng.normal(0, noise, count)
    shell = np.asarray(outline.exterior.coords)[:-1] + ORIGIN[:2]
    points = PointCloud.of(np.stack([x, y, z], 1) + ORIGIN, BUILDING)
    return Evidence("unit", Polygon(shell), points, ORIGIN[2])


def gable(x: FloatArray, y: FloatArray) -> FloatArray:
    """Ridge along x at y = 4, 9 m high; slopes of 40 degrees."""
    return np.asarray(9 - np.tan(np.radians(40)) * np.abs(y - 4))


def hip(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(np.minimum(gable(x, y), 9 - np.tan(np.radians(40)) * (4 - np.minimum(x, 12 - x))))


def gable_with_dormer(x: FloatArray, y: FloatArray) -> FloatArray:
    """A level dormer of 1.8 by 1.6 m in the southern slope."""
    inside = (np.abs(x - 6) < 0.9) & (y > 1.0) & (y < 2.6)
    return np.where(inside, np.maximum(gable(x, y), 7.9), gable(x, y))


def two_levels(x: FloatArray, y: FloatArray) -> FloatArray:
    """Flat roofs with a step of 1.2 m at x = 7."""
    return np.where(x < 7, 6.0, 7.2)


def parallel_slopes(x: FloatArray, y: FloatArray) -> FloatArray:
    """Two sheds of the same slope, the eastern one 0.8 m higher."""
    return 5 + 0.3 * y + np.where(x < 6, 0.0, 0.8)


OUTLINE = box(0, 0, 12, 8)
SCENES: dict[str, tuple[Height, int]] = {
    "gable": (gable, 2),
    "hip": (hip, 4),
    "dormer": (gable_with_dormer, 3),
    "two levels": (two_levels, 2),
    "parallel slopes": (parallel_slopes, 2),
}
