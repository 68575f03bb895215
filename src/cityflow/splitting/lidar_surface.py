"""A raster of what LiDAR points show from above: planes between them, so that roofs of any slope come out even."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import QhullError, cKDTree

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters


def lidar_raster(xyz: FloatArray, bounds: Bounds, cell: float, reach_m: float) -> FrameRasters:
    """Heights at the centres of cells from the triangles between the highest points; NaN further than `reach_m` from any point.

    Parameters
    ----------
    xyz : (N, 3) world metres
    """
    grid = Grid.covering(bounds, cell)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    top = highest_points(xyz, grid)
    middle = np.array([grid.x_min, grid.y_max])
    places = np.column_stack([x.ravel(), y.ravel()]) - middle
    dsm = np.full(x.size, np.nan)
    if len(top) >= 4:
        try:
            dsm = np.asarray(LinearNDInterpolator(top[:, :2] - middle, top[:, 2])(places))
        except QhullError:  # all points on one line: no surface
            dsm = np.full(x.size, np.nan)
        far, _ = cKDTree(top[:, :2] - middle).query(places, distance_upper_bound=reach_m)
        dsm[~np.isfinite(far)] = np.nan
    return FrameRasters(LocalFrame("lidar", np.eye(3), np.zeros(3)), grid, dsm.reshape(grid.shape).astype(np.float32))


def highest_points(xyz: FloatArray, grid: Grid) -> FloatArray:
    """(M, 3) the highest point of each cell of the grid that has any."""
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = np.flatnonzero((row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols))
    cell = row[inside] * grid.cols + col[inside]
    order = np.lexsort((-xyz[inside, 2], cell))
    first = np.r_[True, cell[order][1:] != cell[order][:-1]] if len(order) else np.empty(0, bool)
    return xyz[inside[order[first]]]
