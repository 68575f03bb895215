"""Rays through a field of columns, with a pyramid of maxima to leap over what is low.

The leaps save time and change no answer: a leap is only made over cells none of which reaches the ray.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.geometry.maxima_pyramid import LOWEST, maxima_pyramid

NUDGE = 1e-7
"""Of a cell; so far beyond a border a leap ends."""


def column_pyramid(heights: Float32Array, grid: Grid, origin: FloatArray) -> tuple[Float32Array, IntArray, FloatArray]:
    """Columns as `meets_column` takes them.

    Parameters
    ----------
    heights : (rows, cols) tops of the columns, world metres;  origin : (3,) taken off all coordinates

    Returns
    -------
    All levels in one row, the finest first; (levels, 3) start, rows and columns of each; (3,) x_min, y_max, cell
    """
    level = np.where(heights > LOWEST, heights - np.float64(origin[2]), LOWEST).astype(np.float32)
    place = np.array([grid.x_min - origin[0], grid.y_max - origin[1], grid.cell])
    return *maxima_pyramid(level), place


@njit(cache=True, nogil=True)
def meets_column(levels, layout, place, x, y, z, dx, dy, dz, length):  # type: ignore[no-untyped-def]
    """Whether the ray from (x, y, z) along the unit vector (dx, dy, dz) runs through a column before `length`; metres from the origin."""
    top = layout.shape[0] - 1
    highest = levels[layout[top, 0]]
    if z >= highest and dz >= 0.0:
        return False
    flat = np.sqrt(dx * dx + dy * dy)
    if flat < 1e-12:
        return _over(levels, layout, place, x, y) > (z if dz > 0 else z - length)
    ux, uy, rise = dx / flat, dy / flat, dz / flat
    end, cell = length * flat, place[2]
    s, level = 0.0, 0
    while s < end:
        height = z + rise * s
        if rise >= 0.0 and height >= highest:
            return False
        size = cell * (1 << level)
        px, py = x + ux * s - place[0], place[1] - y - uy * s
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
def _over(levels, layout, place, x, y):  # type: ignore[no-untyped-def]
    """Height of the column at a place."""
    c, r = int(np.floor((x - place[0]) / place[2])), int(np.floor((place[1] - y) / place[2]))
    if c < 0 or r < 0 or c >= layout[0, 2] or r >= layout[0, 1]:
        return LOWEST
    return levels[r * layout[0, 2] + c]
