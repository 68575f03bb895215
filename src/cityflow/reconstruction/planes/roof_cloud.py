"""The roof points of one unit in a local frame, thinned where denser than needed, in a grid of cells.

The order of the points is that of the cells, then of the coordinates: it does not depend on the order in which a
reader delivered them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.planes.plane_segments import Origin

DENSITY_CELL = 1.0
"""Edge of the cells in which the density is counted, metres; set by hand."""
MOST_CELLS = 1 << 40
"""Of an area whose cells are numbered."""


@dataclass(frozen=True, slots=True)
class RoofCloud:
    """Points sorted by cell, row-major from the south-west.

    Attributes
    ----------
    points : (N, 3) float64, local frame, metres
    starts : (rows · cols + 1,) int64, first point of each cell
    cell_of : (N,) int64, cell of each point
    shape : rows and cols, with a rim of empty cells, so that every point has a full 3×3 neighbourhood
    cell : edge of a cell, metres
    density : points per square metre where there are points
    """

    points: FloatArray
    starts: IntArray
    cell_of: IntArray
    shape: tuple[int, int]
    cell: float
    density: float

    def take(self, chosen: IntArray) -> RoofCloud:
        """Some of the points, in ascending order, in the same cells."""
        cell_of = self.cell_of[chosen]
        starts = np.searchsorted(cell_of, np.arange(len(self.starts))).astype(np.int64)
        return RoofCloud(self.points[chosen], starts, cell_of, self.shape, self.cell, self.density)


def local_origin(evidence: Evidence) -> Origin:
    """Whole metres near the south-west corner of the outline and the floor."""
    x_min, y_min, _, _ = evidence.outline.bounds
    return math.floor(x_min), math.floor(y_min), math.floor(evidence.ground_height)


def roof_cloud(local: FloatArray, target_density: float, neighbourhood_points: float) -> RoofCloud:
    """Thin local points to `target_density` and sort them into cells whose 3×3 block holds `neighbourhood_points`."""
    density = typical_density(local)
    if density > target_density:
        local = thin(local, 1 / math.sqrt(target_density))
        density = typical_density(local)
    cell = float(np.clip(math.sqrt(neighbourhood_points / (9 * max(density, 0.1))), 0.3, 1.2))
    return _in_cells(local, cell, density)


def typical_density(points: FloatArray) -> float:
    """Median number of points per square metre over the square metres around the points."""
    if len(points) == 0:
        return 0.0
    cells = np.floor(points[:, :2] / DENSITY_CELL).astype(np.int64)
    _, inverse, counts = np.unique(
        cells[:, 0] << 32 | cells[:, 1] & 0xFFFFFFFF, return_inverse=True, return_counts=True
    )
    return float(np.median(counts[inverse])) / DENSITY_CELL**2


def thin(points: FloatArray, cell: float) -> FloatArray:
    """One point per occupied cell: mean position, median height; averages away the noise of dense clouds."""
    col, row = (np.floor(points[:, i] / cell).astype(np.int64) for i in (0, 1))
    order = _by_cell_and_height(points, col, row)
    ordered, keys = points[order], np.stack([row[order], col[order]], 1)
    first = np.flatnonzero(np.r_[True, np.any(keys[1:] != keys[:-1], axis=1)])
    counts = np.diff(np.r_[first, len(points)])
    mean = np.add.reduceat(ordered[:, :2], first, axis=0) / counts[:, None]
    height = (ordered[first + (counts - 1) // 2, 2] + ordered[first + counts // 2, 2]) / 2
    return np.column_stack([mean, height])


def _by_cell_and_height(points: FloatArray, col: IntArray, row: IntArray) -> IntArray:
    """Order by row, column, z, x and y. Two keys do where no two heights of a cell are the same."""
    if not len(points):
        return np.empty(0, np.int64)
    row, col = row - row.min(), col - col.min()
    width = int(col.max()) + 1
    if (int(row.max()) + 1) * width < MOST_CELLS:
        cell = row * width + col
        order = np.lexsort((points[:, 2], cell))
        z, cell = points[order, 2], cell[order]
        if not np.any(~(z[1:] > z[:-1]) & (cell[1:] == cell[:-1])):
            return order
    return np.lexsort((points[:, 1], points[:, 0], points[:, 2], col, row))


def _in_cells(points: FloatArray, cell: float, density: float) -> RoofCloud:
    low = points[:, :2].min(axis=0) if len(points) else np.zeros(2)
    col, row = (np.floor((points[:, i] - low[i]) / cell).astype(np.int64) + 1 for i in (0, 1))
    rows, cols = (int(a.max()) + 2 if len(points) else 3 for a in (row, col))
    cell_of = row * cols + col
    order = np.lexsort((points[:, 2], points[:, 1], points[:, 0], cell_of))
    starts = np.searchsorted(cell_of[order], np.arange(rows * cols + 1)).astype(np.int64)
    return RoofCloud(np.ascontiguousarray(points[order]), starts, cell_of[order], (rows, cols), cell, density)
