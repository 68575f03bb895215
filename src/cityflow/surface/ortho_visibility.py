"""Occlusion of a point by the surface; away from the point the surface is slightly widened."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, block_reduced
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.geometry.ray_march import LOWEST, Columns, Ray, columns_over, march, tops_from


class Obstacles(NamedTuple):
    """A surface to look over.

    Attributes
    ----------
    columns : the widened surface
    sharp : (rows, cols) float32, the surface itself, metres from the columns' origin
    radius : so near to a point the surface itself is looked at, metres
    tolerance : a ray may dip this deep below the surface, metres
    reach : what stands farther off (in plan) hides nothing, metres
    """

    columns: Columns
    sharp: Float32Array
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
    return Obstacles(columns_over(grid, wide, origin), sharp, radius, float(tolerance_m), float(reach_m))


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


@njit(cache=True, nogil=True)
def is_hidden(obstacles, x, y, z, dx, dy, dz):  # type: ignore[no-untyped-def]
    """Whether the ray from (x, y, z) along (dx, dy, dz), upwards, runs below the surface; metres from the obstacles' origin."""
    flat = np.sqrt(dx * dx + dy * dy)
    if flat < 1e-9 or dz <= 0.0:
        return dz <= 0.0
    ray = Ray(x, y, z, dx / flat, dy / flat, dz / flat)
    end = min(obstacles.reach, flat)
    near = min(obstacles.radius, end)
    return _near_hidden(obstacles, ray, near) or march(obstacles.columns, ray, near, end, obstacles.tolerance)


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
