"""Points to rasters: top and bottom height per cell, counts, filled holes.

Expects a cleaned cloud (`noise.clean`): the highest first return of a cell is then its top.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.core.points import PointCloud


def cell_of(points: PointCloud, grid: Grid) -> tuple[IntArray, BoolArray]:
    """Flat cell index per point inside the grid, and which points (N,) lie inside."""
    row, col = grid.indices(points.xyz[:, 0], points.xyz[:, 1])
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    return row[inside] * grid.cols + col[inside], inside


def count_points(points: PointCloud, grid: Grid) -> IntArray:
    """(rows, cols) number of points per cell."""
    cell, _ = cell_of(points, grid)
    return np.bincount(cell, minlength=grid.rows * grid.cols).reshape(grid.shape)


def sums_around(counts: IntArray, size: int, mode: str) -> FloatArray:
    """(rows, cols) sums of whole numbers over squares of `size` cells around each cell; beyond the array as `mode` of scipy.ndimage says.

    They are exact. Means of a moving window carry rounding errors from where the array begins on, which would decide ties otherwise in one tile
    than in the next.
    """
    return np.asarray(np.rint(uniform_filter(counts.astype(float), size, mode=mode) * size**2))


def highest(points: PointCloud, grid: Grid) -> FloatArray:
    """(rows, cols) highest first return per cell; where a cell has later returns only, the highest of them."""
    first = points.return_number <= 1
    top = _extreme(points, grid, first, upper=True)
    if first.all():
        return top
    return np.where(np.isnan(top), _extreme(points, grid, ~first, upper=True), top)


def lowest(points: PointCloud, grid: Grid) -> FloatArray:
    """(rows, cols) lowest return per cell; NaN without points."""
    return _extreme(points, grid, np.ones(len(points), bool), upper=False)


def _extreme(points: PointCloud, grid: Grid, chosen: BoolArray, *, upper: bool) -> FloatArray:
    cell, inside = cell_of(points, grid)
    use = chosen[inside]
    z = points.xyz[inside, 2][use]
    flat = np.full(grid.rows * grid.cols, np.nan)
    _scatter_extreme(flat, cell[use], z, upper)
    return flat.reshape(grid.shape)


@njit(cache=True, nogil=True)
def _scatter_extreme(flat: FloatArray, cell: IntArray, z: FloatArray, upper: bool) -> None:
    for i in range(len(cell)):
        old = flat[cell[i]]
        if np.isnan(old) or (upper and z[i] > old) or (not upper and z[i] < old):
            flat[cell[i]] = z[i]


def fill_holes(values: FloatArray, reach_cells: int) -> FloatArray:
    """Fill NaN cells from their valid neighbours, ring after ring, with the lower median of the 3 x 3 window.

    The lower median keeps a hole at a wall from becoming a slope. Cells further than `reach_cells` from any value
    stay NaN, so that a fill never depends on what lies far away.
    """
    filled = values.copy()
    for _ in range(reach_cells):
        if not np.isnan(filled).any():
            break
        filled = _fill_ring(filled)
    return filled


@njit(cache=True, nogil=True)
def _fill_ring(values: FloatArray) -> FloatArray:
    rows, cols = values.shape
    out = values.copy()
    near = np.empty(8)
    for r in range(rows):
        for c in range(cols):
            if not np.isnan(values[r, c]):
                continue
            n = 0
            for i in range(max(r - 1, 0), min(r + 2, rows)):
                for j in range(max(c - 1, 0), min(c + 2, cols)):
                    if not np.isnan(values[i, j]):
                        near[n] = values[i, j]
                        n += 1
            if n >= 2:
                out[r, c] = np.sort(near[:n])[(n - 1) // 2]
    return out
