"""Points of one unit in the cells of a plan grid, and planes of cells from sums over their points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

SUMS = 10
"""Columns of a row of sums: count, sums of x, y, z, and of their products."""
COUNT, X, Y, Z, XX, XY, YY, XZ, YZ, ZZ = range(SUMS)

LEAST_CELL_M, LARGEST_CELL_M = 0.5, 1.5
"""Errors of matched heights are alike over some pixels, so that a smaller cell is flat and leans, however many points it holds; set by hand, as are
those below."""
MOST_CELLS = 400_000
"""Bounds memory."""
FLAT_ROUND = 1e-4
"""Points whose spread across is less than this share of that along (squared) stand on a line."""


@dataclass(frozen=True, slots=True)
class CellGrid:
    """A grid in plan over the local frame; row 0 is the southernmost.

    Attributes
    ----------
    x0, y0 : outer corner of cell (0, 0), metres
    cell : edge of a cell, metres
    rows, cols : with a rim of one cell around everything
    """

    x0: float
    y0: float
    cell: float
    rows: int
    cols: int

    @classmethod
    def over(cls, bounds: tuple[float, float, float, float], cell: float) -> CellGrid:
        """A grid over a box and one cell more on every side; coarser where it would be too large."""
        width, height = bounds[2] - bounds[0], bounds[3] - bounds[1]
        cell = max(cell, math.sqrt(max(width * height, 0.0) / MOST_CELLS), max(width, height) / MOST_CELLS)
        cols, rows = math.ceil(width / cell) + 2, math.ceil(height / cell) + 2
        return cls(bounds[0] - cell, bounds[1] - cell, cell, rows, cols)

    @property
    def shape(self) -> tuple[int, int]:
        return self.rows, self.cols

    def centres(self) -> tuple[FloatArray, FloatArray]:
        """(rows, cols) x and y of the middles of cells."""
        x = self.x0 + (np.arange(self.cols) + 0.5) * self.cell
        y = self.y0 + (np.arange(self.rows) + 0.5) * self.cell
        grids = np.meshgrid(x, y)
        return grids[0], grids[1]

    def corners(self, row_col: FloatArray) -> FloatArray:
        """(N, 2) x, y of lattice corners given as row, col."""
        return np.column_stack([self.x0 + row_col[:, 1] * self.cell, self.y0 + row_col[:, 0] * self.cell])

    def cell_of(self, xy: FloatArray) -> IntArray:
        """(N,) flat cell of each point, −1 outside."""
        col = np.floor((xy[:, 0] - self.x0) / self.cell).astype(np.int64)
        row = np.floor((xy[:, 1] - self.y0) / self.cell).astype(np.int64)
        inside = (col >= 0) & (col < self.cols) & (row >= 0) & (row < self.rows)
        return np.where(inside, row * self.cols + col, -1)


@dataclass(frozen=True, slots=True)
class CellPoints:
    """Points sorted by cell.

    Attributes
    ----------
    grid : CellGrid
    points : (N, 3) float64, local, metres, sorted by cell
    starts : (cells + 1,) int64
    sums : (cells, 10) float64, see `SUMS`
    """

    grid: CellGrid
    points: FloatArray
    starts: IntArray
    sums: FloatArray

    @classmethod
    def of(cls, grid: CellGrid, points: FloatArray) -> CellPoints:
        cell = grid.cell_of(points[:, :2])
        points, cell = points[cell >= 0], cell[cell >= 0]
        # ordered by position, too, so that the order in which a reader delivered them is nowhere felt
        order = np.lexsort((points[:, 2], points[:, 1], points[:, 0], cell))
        points, cell = np.ascontiguousarray(points[order]), cell[order]
        cells = grid.rows * grid.cols
        starts = np.searchsorted(cell, np.arange(cells + 1)).astype(np.int64)
        return cls(grid, points, starts, _sums(points, cell, cells))

    def counts(self) -> IntArray:
        """(cells,) points in each cell."""
        return np.diff(self.starts).astype(np.int64)

    def members(self, cells: IntArray) -> IntArray:
        """Indices of the points in some cells."""
        if len(cells) == 0:
            return np.empty(0, np.int64)
        return np.concatenate([np.arange(self.starts[k], self.starts[k + 1]) for k in cells])


def spacing(density: float, noise: float, slope_sigma: float, least_points: float) -> float:
    """Edge of a cell (m) whose own plane is known to `slope_sigma` in slope, and that holds enough points.

    Slope of a plane through n = density·a² points spread evenly over a cell of edge a: sigma = noise·√12 / (a·√n).

    Parameters
    ----------
    density : points per m²
    noise : metres
    """
    density = max(density, 1e-3)
    by_noise = math.sqrt(noise * math.sqrt(12.0) / (slope_sigma * math.sqrt(density)))
    by_count = math.sqrt(least_points / density)
    return float(np.clip(max(by_noise, by_count), LEAST_CELL_M, LARGEST_CELL_M))


@njit(cache=True, nogil=True)
def _sums(points: FloatArray, cell: IntArray, cells: int) -> FloatArray:
    out = np.zeros((cells, SUMS))
    for i in range(len(points)):
        x, y, z = points[i]
        row = out[cell[i]]
        row[COUNT] += 1.0
        row[X] += x
        row[Y] += y
        row[Z] += z
        row[XX] += x * x
        row[XY] += x * y
        row[YY] += y * y
        row[XZ] += x * z
        row[YZ] += y * z
        row[ZZ] += z * z
    return out


@njit(cache=True, nogil=True)
def plane_of_sums(row: FloatArray, out: FloatArray) -> bool:
    """Plane from sums into `out`: a, b, c, and the RMS across it (m); False where the points do not tell it."""
    n = row[COUNT]
    if n < 3:
        return False
    mx, my, mz = row[X] / n, row[Y] / n, row[Z] / n
    xx, xy, yy = row[XX] - n * mx * mx, row[XY] - n * mx * my, row[YY] - n * my * my
    xz, yz, zz = row[XZ] - n * mx * mz, row[YZ] - n * my * mz, row[ZZ] - n * mz * mz
    determinant = xx * yy - xy * xy
    if determinant <= FLAT_ROUND * (xx + yy) * (xx + yy):
        return False
    a = (xz * yy - yz * xy) / determinant
    b = (yz * xx - xz * xy) / determinant
    out[0], out[1], out[2] = a, b, mz - a * mx - b * my
    left = max(zz - a * xz - b * yz, 0.0)
    out[3] = np.sqrt(left / max(n - 3.0, 1.0) / (1.0 + a * a + b * b))
    return True
