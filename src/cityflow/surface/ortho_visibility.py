"""Is a point hidden from a camera by the surface? Rays march through the DSM's columns, with a pyramid of maxima to leap over what is low.

The leaps save time and change no answer: a leap is only made over cells none of which reaches the ray.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.geometry.maxima_pyramid import LOWEST, maxima_pyramid


@dataclass(frozen=True, slots=True)
class Obstacles:
    """A surface to look over.

    Attributes
    ----------
    levels : all levels of maxima in one row of float32, the finest first; heights in metres
    layout : (levels, 3) int64, start, rows and columns of each
    place : (6,) x_min, y_max, cell, widening radius in metres, tolerance in metres, reach in metres
    sharp : (rows, cols) float32, the surface itself; the levels are those of the widened one
    """

    levels: Float32Array
    layout: np.ndarray[tuple[int, int], np.dtype[np.int64]]
    place: FloatArray
    sharp: Float32Array


def obstacles(
    grid: Grid, heights: Float32Array, origin: FloatArray, widened_cells: int, tolerance_m: float, reach_m: float
) -> Obstacles:
    """Prepare a surface for `is_hidden`.

    Parameters
    ----------
    heights : (rows, cols) float32, metres; NaN hides nothing
    origin : (3,) subtracted from world coordinates
    widened_cells : how many cells things that stand farther off than that are widened: a DSM's edges are no better
    tolerance_m : a ray may dip this deep below the surface
    reach_m : things farther off (in plan) hide nothing
    """
    sharp = np.where(np.isnan(heights), LOWEST, heights - origin[2]).astype(np.float32)
    size = 2 * widened_cells + 1
    wide = np.asarray(cv2.dilate(sharp, np.ones((size, size), np.uint8), borderType=cv2.BORDER_REPLICATE), np.float32)
    levels, layout = maxima_pyramid(wide)
    radius = (widened_cells + 0.5) * grid.cell * np.sqrt(2.0)
    place = np.array([grid.x_min - origin[0], grid.y_max - origin[1], grid.cell, radius, tolerance_m, reach_m])
    return Obstacles(levels, layout, place, np.ascontiguousarray(sharp))


def block_maxima(grid: Grid, heights: Float32Array, factor: int) -> tuple[Grid, Float32Array]:
    """A surface on cells `factor` times as wide, each with the greatest height in it, so that walls thinner than a cell still hide.

    The cells lie on the world's lattice, whatever the grid: tiles that share ground share cells, but for those cut by the grid's edge.
    NaN only where all is NaN.
    """
    if factor <= 1:
        return grid, heights
    wide = Grid.covering(grid.bounds, grid.cell * factor)
    above, left = round((wide.y_max - grid.y_max) / grid.cell), round((grid.x_min - wide.x_min) / grid.cell)
    full = np.full((wide.rows * factor, wide.cols * factor), np.float32(LOWEST), np.float32)
    part = full[above : above + grid.rows, left : left + grid.cols]
    np.copyto(part, heights, where=~np.isnan(heights))
    most = full.reshape(wide.rows, factor, wide.cols, factor).max(axis=(1, 3))
    return wide, np.where(most > LOWEST, most, np.float32(np.nan))


@njit(cache=True, nogil=True)
def is_hidden(levels, layout, place, sharp, x, y, z, dx, dy, dz):  # type: ignore[no-untyped-def]
    """Whether the ray from (x, y, z) along (dx, dy, dz), upwards, runs below the surface; metres from the obstacles' origin."""
    flat = np.sqrt(dx * dx + dy * dy)
    if flat < 1e-9 or dz <= 0.0:
        return dz <= 0.0
    ux, uy, rise = dx / flat, dy / flat, dz / flat
    end = min(place[5], flat)
    near = min(place[3], end)
    if _near_hidden(place, sharp, x, y, z, ux, uy, rise, near):
        return True
    return _far_hidden(levels, layout, place, x, y, z, ux, uy, rise, near, end)


@njit(cache=True, nogil=True)
def _near_hidden(place, sharp, x, y, z, ux, uy, rise, end):  # type: ignore[no-untyped-def]
    """Cells around the point, at their true width."""
    cell = place[2]
    col, row = (x - place[0]) / cell, (place[1] - y) / cell
    rows, cols = sharp.shape
    own_c, own_r = int(np.floor(col)), int(np.floor(row))
    step = 0.5
    s = step
    while s * cell <= end:
        c, r = int(np.floor(col + ux * s)), int(np.floor(row - uy * s))
        if c < 0 or r < 0 or c >= cols or r >= rows:
            return False
        if (c != own_c or r != own_r) and sharp[r, c] > z + rise * s * cell + place[4]:
            return True
        s += step
    return False


@njit(cache=True, nogil=True)
def _far_hidden(levels, layout, place, x, y, z, ux, uy, rise, s, end):  # type: ignore[no-untyped-def]
    cell = place[2]
    top = layout.shape[0] - 1
    highest = levels[layout[top, 0]]
    level = 0
    nudge = 1e-7 * cell
    while s < end:
        height = z + rise * s + place[4]
        if height >= highest:
            return False
        size = cell * (1 << level)
        px, py = x + ux * s - place[0], place[1] - y - uy * s
        c, r = int(np.floor(px / size)), int(np.floor(py / size))
        if c < 0 or r < 0 or c >= layout[level, 2] or r >= layout[level, 1]:
            return False
        if levels[layout[level, 0] + r * layout[level, 2] + c] > height:
            if level == 0:
                return True
            level -= 1
            continue
        leap_x = ((c + 1) * size - px) / ux if ux > 0 else ((c * size - px) / ux if ux < 0 else 1e30)
        leap_y = ((r + 1) * size - py) / -uy if uy < 0 else ((r * size - py) / -uy if uy > 0 else 1e30)
        s += min(leap_x, leap_y) + nudge
        level = min(level + 1, top)
    return False
