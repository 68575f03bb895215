"""From a rough terrain to the points that lie on the ground, and from them to the final terrain."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud
from cityflow.surface.gridding import bridge_gaps, terrain_from_points
from cityflow.surface.rasterise import lowest
from cityflow.surface.sample import sample

WORK_CELL_M = 1.0
"""Cells on which terrain is sought and the survey's edge found, metres; set by hand: at the usual densities most hold a return."""


def work_grid(grid: Grid) -> Grid:
    """The grid over the same area with cells of `WORK_CELL_M` on the world lattice."""
    return Grid.covering(grid.bounds, WORK_CELL_M)


def lowest_surface(points: PointCloud, grid: Grid) -> FloatArray:
    """(rows, cols) lowest return per cell with gaps bridged linearly; low points that nothing supports removed.

    A cell is lowered by multipath to far below everything around; it is raised again where it lies more than 1 m
    below the second lowest cell of its 3 x 3 window.
    """
    low = lowest(points, grid)
    filled = bridge_gaps(low, grid)
    padded = np.pad(filled, 1, mode="edge")
    shifted = [padded[i : i + grid.rows, j : j + grid.cols] for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    second = np.sort(np.stack(shifted), axis=0)[1]
    return np.where(filled < second - 1.0, second, filled)


def slope_of(surface: FloatArray, cell_m: float) -> FloatArray:
    """(rows, cols) magnitude of the gradient, dimensionless."""
    if min(surface.shape) < 2:
        return np.zeros(surface.shape)
    d_r, d_c = np.gradient(surface, cell_m)
    return np.hypot(d_r, d_c)


def refine(
    points: PointCloud, rough: FloatArray, rough_grid: Grid, grid: Grid, tolerance: tuple[float, float]
) -> FloatArray:
    """(rows, cols) of `grid`: final terrain from the points within a tolerance of a rough one.

    The tolerance in metres is ``tolerance[0] + tolerance[1]·slope``. A second pass asks the same of the first
    result, which is closer to the truth, so that low vegetation leaves and cut crests return.
    """
    last = points.return_number >= points.number_of_returns
    xyz = points.xyz[last]
    better = terrain_from_points(_near(xyz, rough, rough_grid, tolerance), rough_grid)
    return terrain_from_points(_near(xyz, better, rough_grid, tolerance), grid)


def _near(xyz: FloatArray, surface: FloatArray, grid: Grid, tolerance: tuple[float, float]) -> FloatArray:
    """Those of the points (N, 3) that lie within the tolerance of a surface."""
    height = sample(grid, surface, xyz[:, 0], xyz[:, 1])
    slope = sample(grid, slope_of(surface, grid.cell), xyz[:, 0], xyz[:, 1])
    return xyz[np.abs(xyz[:, 2] - height) <= tolerance[0] + tolerance[1] * np.minimum(slope, 1.5)]


def resample(surface: FloatArray, surface_grid: Grid, grid: Grid) -> FloatArray:
    """A raster at the cell centres of another grid."""
    x, y = grid.centres()
    return sample(surface_grid, surface, x, y)
