"""Rays through a field of columns, with a pyramid of maxima to skip low areas.

The leaps save time and change no answer: a leap is only made over cells none of which reaches the ray.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, IntArray, block_reduced
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit

LOWEST = np.float32(-1e9)
"""Top of a column where nothing is."""
NUDGE = 1e-7
"""Of a cell; so far beyond a border a leap ends."""


class Columns(NamedTuple):
    """A field of columns, in metres from an origin.

    Attributes
    ----------
    levels : tops, all levels of the pyramid in one row of float32, the finest first
    layout : (levels, 3) int64, start, rows and columns of each
    x_min, y_max, cell : where the field lies, metres
    """

    levels: Float32Array
    layout: IntArray
    x_min: float
    y_max: float
    cell: float


class Ray(NamedTuple):
    """A ray that is not upright, by its way in plan.

    Attributes
    ----------
    x, y, z : where it begins, metres from the columns' origin
    ux, uy : unit vector in plan
    rise : metres of height per metre in plan
    """

    x: float
    y: float
    z: float
    ux: float
    uy: float
    rise: float


def tops_from(heights: Float32Array, z_0: float) -> Float32Array:
    """(rows, cols) float32 tops of columns, metres from the height `z_0`; `LOWEST` where heights are NaN or nothing is."""
    return np.asarray(_tops(np.ascontiguousarray(heights), float(z_0)))


@njit(cache=True, nogil=True)
def _tops(heights, z_0):  # type: ignore[no-untyped-def]
    out = np.full(heights.shape, LOWEST, np.float32)
    for r in range(heights.shape[0]):
        for c in range(heights.shape[1]):
            if heights[r, c] > LOWEST:
                out[r, c] = np.float64(heights[r, c]) - z_0
    return out


def columns_over(grid: Grid, tops: Float32Array, origin: FloatArray) -> Columns:
    """Columns with tops as `tops_from` makes them, and whose place is counted from an origin (world metres), too."""
    levels, layout = maxima_pyramid(tops)
    return Columns(levels, layout, float(grid.x_min - origin[0]), float(grid.y_max - origin[1]), float(grid.cell))


def maxima_pyramid(tops: Float32Array) -> tuple[Float32Array, IntArray]:
    """All levels of (rows, cols) tops in one row, each cell the greatest of four, up to a single cell; (levels, 3) start, rows and columns of each.

    >>> levels, layout = maxima_pyramid(np.array([[1.0, 5.0, 2.0]], np.float32))
    >>> levels.tolist(), layout.tolist()
    ([1.0, 5.0, 2.0, 5.0, 2.0, 5.0], [[0, 1, 3], [3, 1, 2], [5, 1, 1]])
    """
    level, levels, layout, start = tops, [], [], 0
    while True:
        levels.append(level.ravel())
        layout.append((start, *level.shape))
        start += level.size
        if max(level.shape) == 1:
            return np.concatenate(levels), np.array(layout, np.int64)
        rows, cols = level.shape
        even = np.pad(level, ((0, rows % 2), (0, cols % 2)), constant_values=LOWEST)
        level = block_reduced(np.maximum, even, 2)


@njit(cache=True, nogil=True)
def meets_column(columns: Columns, start: FloatArray, towards: FloatArray, length: float) -> bool:
    """Whether a ray from `start` along the unit vector `towards` runs through a column before `length`; metres from the origin."""
    dx, dy, dz = towards
    flat = np.sqrt(dx * dx + dy * dy)
    if flat < 1e-12:
        return _top(columns, start[0], start[1]) > (start[2] if dz > 0 else start[2] - length)
    ray = Ray(start[0], start[1], start[2], dx / flat, dy / flat, dz / flat)
    return march(columns, ray, 0.0, length * flat, 0.0)


@njit(cache=True, nogil=True)
def march(columns: Columns, ray: Ray, begin: float, end: float, lifted: float) -> bool:
    """Whether a ray, `lifted` by some metres, runs through a column between two distances in plan."""
    levels, layout, x_min, y_max, cell = columns
    x, y, z, ux, uy, rise = ray
    top = layout.shape[0] - 1
    highest = levels[layout[top, 0]]
    s, level = begin, 0
    while s < end:
        height = z + rise * s + lifted
        if rise >= 0.0 and height >= highest:
            return False
        size = cell * (1 << level)
        px, py = x + ux * s - x_min, y_max - y - uy * s
        c, r = int(np.floor(px / size)), int(np.floor(py / size))
        if c < 0 or r < 0 or c >= layout[level, 2] or r >= layout[level, 1]:
            return False
        leap_x = ((c + 1) * size - px) / ux if ux > 0 else ((c * size - px) / ux if ux < 0 else 1e30)
        leap_y = ((r + 1) * size - py) / -uy if uy < 0 else ((r * size - py) / -uy if uy > 0 else 1e30)
        leap = min(leap_x, leap_y)
        lowest = height if rise >= 0.0 else height + rise * min(leap, end - s)
        if levels[layout[level, 0] + r * layout[level, 2] + c] > lowest:
            if level == 0:
                return True
            level -= 1
            continue
        s += leap + NUDGE * cell
        level = min(level + 1, top)
    return False


@njit(cache=True, nogil=True, inline="always")
def _top(columns: Columns, x: float, y: float) -> float:
    """Top of the column at a place."""
    c, r = int(np.floor((x - columns.x_min) / columns.cell)), int(np.floor((columns.y_max - y) / columns.cell))
    if c < 0 or r < 0 or c >= columns.layout[0, 2] or r >= columns.layout[0, 1]:
        return float(LOWEST)
    return columns.levels[r * columns.layout[0, 2] + c]
