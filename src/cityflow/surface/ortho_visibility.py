"""Occlusion of a point by the surface; away from the point the surface is slightly widened."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, block_reduced
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.geometry.ray_march import LOWEST, Columns, Ray, columns_over, march, maxima_pyramid, tops_from

FIRST_RING = 2
"""Level of the columns' pyramid whose cells are the first to be asked what stands around."""
WITHIN = 0.999
"""Share of the width of a cell that a place can be away from it and surely in a cell beside it."""
TREND_CELLS = 16
"""Between heights whose differences tell how a surface slants."""
ROUNDED_M = 0.002
"""More than float32 rounds a height of kilometres by."""


class Around(NamedTuple):
    """What rises how high around each cell, over a plane that the surface mostly follows, as the ground does in a tilted frame.

    Attributes
    ----------
    east, south : slopes of the plane
    near : the greatest height over it in each square of 2 to the power of `near_level` cells and the eight around, metres: all that is as near as
        `Obstacles.radius`
    rings : the levels of a pyramid of heights over it from `FIRST_RING` on, each cell the greatest of the nine around, metres
    """

    east: float
    south: float
    near_level: int
    near: Float32Array
    rings: Float32Array


class Obstacles(NamedTuple):
    """A surface to look over.

    Attributes
    ----------
    columns : the widened surface
    sharp : (rows, cols) float32, the surface itself, metres from the columns' origin
    around : what spares most rays a walk over it
    radius : so near to a point the surface itself is looked at, metres
    tolerance : a ray may dip this deep below the surface, metres
    reach : what stands farther off (in plan) hides nothing, metres
    """

    columns: Columns
    sharp: Float32Array
    around: Around
    radius: float
    tolerance: float
    reach: float


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
    sharp = np.ascontiguousarray(tops_from(heights, origin[2]))
    size = 2 * widened_cells + 1
    wide = np.asarray(cv2.dilate(sharp, np.ones((size, size), np.uint8), borderType=cv2.BORDER_REPLICATE), np.float32)
    radius = float((widened_cells + 0.5) * grid.cell * np.sqrt(2.0))
    columns = columns_over(grid, wide, origin)
    # cells around a point are looked at in half steps
    near_level = int(np.ceil(np.log2(max(np.floor(2.0 * radius / grid.cell) / 2.0, 1.0))))
    around = _around(sharp, wide, grid.cell, near_level)
    return Obstacles(columns, sharp, around, radius, float(tolerance_m), float(reach_m))


def _around(sharp: Float32Array, wide: Float32Array, cell: float, near_level: int) -> Around:
    east, south = _trend(wide, cell)
    slopes, rings = (np.float32(east * cell), np.float32(south * cell)), []
    levels, layout = maxima_pyramid(_highest(wide, 1 << FIRST_RING, *slopes))
    for start, rows, cols in layout.tolist():
        rings.append(_greatest_around(levels[start : start + rows * cols].reshape(rows, cols)).ravel())
    near = _greatest_around(_highest(sharp, 1 << near_level, *slopes))
    return Around(east, south, near_level, near, np.concatenate(rings))


@njit(cache=True, nogil=True)
def _highest(tops, size, east, south):  # type: ignore[no-untyped-def]
    """(rows / size, cols / size) the greatest height of each block of cells over a plane through the upper left corner, by its rise from cell to cell."""
    rows, cols = tops.shape
    out = np.full(((rows + size - 1) // size, (cols + size - 1) // size), LOWEST)
    for r in range(rows):
        for c in range(cols):
            top = tops[r, c]
            if top > LOWEST:
                top -= south * np.float32(r + 0.5) + east * np.float32(c + 0.5)
                out[r // size, c // size] = max(out[r // size, c // size], top)
    return out


def _trend(tops: Float32Array, cell: float) -> tuple[float, float]:
    """How a surface mostly slants eastwards and southwards."""
    some = np.where(tops > LOWEST, tops, np.float32(np.nan))[::TREND_CELLS, ::TREND_CELLS]
    slopes = []
    for axis in (1, 0):
        steps = np.diff(some, axis=axis)
        steps = steps[np.isfinite(steps)]
        slopes.append(float(np.median(steps)) / (TREND_CELLS * cell) if steps.size else 0.0)
    return slopes[0], slopes[1]


def _greatest_around(tops: Float32Array) -> Float32Array:
    """(rows, cols) the greatest of a cell and the eight around it; beyond the raster nothing is."""
    return np.asarray(cv2.dilate(tops, np.ones((3, 3), np.uint8)), np.float32)


class BlockingSurface(NamedTuple):
    """Heights that may hide what lies behind them, (rows, cols) of `grid`, metres; NaN hides nothing."""

    grid: Grid
    heights: Float32Array


def block_maxima(grid: Grid, heights: Float32Array, factor: int) -> BlockingSurface:
    """A surface on cells `factor` times as wide, each with the greatest height in it, so that walls thinner than a cell still hide.

    The cells lie on the world's lattice, whatever the grid: tiles that share ground share cells, but for those cut by the grid's edge.
    NaN only where all is NaN.
    """
    if factor <= 1:
        return BlockingSurface(grid, heights)
    wide = Grid.covering(grid.bounds, grid.cell * factor)
    above, left = round((wide.y_max - grid.y_max) / grid.cell), round((grid.x_min - wide.x_min) / grid.cell)
    full = np.full((wide.rows * factor, wide.cols * factor), np.float32(LOWEST), np.float32)
    part = full[above : above + grid.rows, left : left + grid.cols]
    np.copyto(part, heights, where=~np.isnan(heights))
    most = block_reduced(np.maximum, full, factor)
    return BlockingSurface(wide, np.where(most > LOWEST, most, np.float32(np.nan)))


@njit(cache=True, nogil=True, inline="always")
def is_hidden(obstacles, x, y, z, dx, dy, dz):  # type: ignore[no-untyped-def]
    """Whether the ray from (x, y, z) along (dx, dy, dz), upwards, runs below the surface; metres from the obstacles' origin."""
    flat = np.sqrt(dx * dx + dy * dy)
    if flat < 1e-9 or dz <= 0.0:
        return dz <= 0.0
    ray = Ray(x, y, z, dx / flat, dy / flat, dz / flat)
    end = min(obstacles.reach, flat)
    near = min(obstacles.radius, end)
    columns = obstacles.columns
    col, row = int(np.floor((x - columns.x_min) / columns.cell)), int(np.floor((columns.y_max - y) / columns.cell))
    if col < 0 or row < 0 or col >= columns.layout[0, 2] or row >= columns.layout[0, 1]:
        return _near_hidden(obstacles, ray, near) or march(columns, ray, near, end, obstacles.tolerance)
    # mostly nothing around rises so far over the plane of the surface, which is told without a step along the ray
    around, cell = obstacles.around, columns.cell
    slack = 0.5 * cell * (abs(around.east) + abs(around.south)) + ROUNDED_M
    height = z + obstacles.tolerance - around.east * (x - columns.x_min) - around.south * (columns.y_max - y) - slack
    rise = ray.rise - around.east * ray.ux + around.south * ray.uy
    rises = rise < 0.0 or around.near[row >> around.near_level, col >> around.near_level] > height
    if rises and _near_hidden(obstacles, ray, near):
        return True
    clear = _clear_from(columns.layout, around.rings, (row, col, cell), (height, rise), near, end)
    return near < clear and march(columns, ray, near, clear, obstacles.tolerance)


@njit(cache=True, nogil=True)
def _clear_from(layout, rings, place, ray, begin, end):  # type: ignore[no-untyped-def]
    """Distance in plan from which on a ray meets nothing before `end`, as far as cells around its own on each level tell; not before `begin`.

    `ray` is its height over the plane of the surface at its start, and its rise over it.
    """
    (row, col, cell), (height, rise) = place, ray
    top = layout.shape[0] - 1
    if top < FIRST_RING:
        return end
    clear, s, before = begin, begin, layout[FIRST_RING, 0]
    highest = rings[layout[top, 0] - before]
    for level in range(FIRST_RING, top + 1):
        if s >= end or (rise >= 0.0 and height + rise * s >= highest):
            break
        out = max(min(WITHIN * cell * (1 << level), end) if level < top else end, s)
        lowest = height + rise * (s if rise >= 0.0 else out)
        if rings[layout[level, 0] - before + (row >> level) * layout[level, 2] + (col >> level)] > lowest:
            clear = out
        s = out
    return clear


@njit(cache=True, nogil=True)
def _near_hidden(obstacles, ray, end):  # type: ignore[no-untyped-def]
    """Cells around the point, at their true width."""
    sharp, cell = obstacles.sharp, obstacles.columns.cell
    col, row = (ray.x - obstacles.columns.x_min) / cell, (obstacles.columns.y_max - ray.y) / cell
    rows, cols = sharp.shape
    own_c, own_r = int(np.floor(col)), int(np.floor(row))
    step = 0.5
    s = step
    while s * cell <= end:
        c, r = int(np.floor(col + ray.ux * s)), int(np.floor(row - ray.uy * s))
        if c < 0 or r < 0 or c >= cols or r >= rows:
            return False
        if (c != own_c or r != own_r) and sharp[r, c] > ray.z + ray.rise * s * cell + obstacles.tolerance:
            return True
        s += step
    return False
