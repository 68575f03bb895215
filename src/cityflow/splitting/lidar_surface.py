"""A raster of the highest LiDAR points, as fine as their density allows."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters


def lidar_raster(xyz: FloatArray, bounds: Bounds, cell: float, reach_m: float) -> FrameRasters:
    """Highest point of each cell; a cell without one takes the nearest cell's height up to `reach_m`, beyond it is NaN.

    Parameters
    ----------
    xyz : (N, 3) world metres
    """
    grid = Grid.covering(bounds, cell)
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    dsm = np.full(grid.rows * grid.cols, -np.inf)
    np.maximum.at(dsm, row[inside] * grid.cols + col[inside], xyz[inside, 2])
    return FrameRasters(
        LocalFrame("lidar", np.eye(3), np.zeros(3)), grid, _filled(dsm.reshape(grid.shape), reach_m / cell)
    )


def _filled(dsm: FloatArray, reach_cells: float) -> Float32Array:
    empty = ~np.isfinite(dsm)
    if empty.all():
        return np.full(dsm.shape, np.nan, np.float32)
    far, nearest = ndimage.distance_transform_edt(empty, return_indices=True)
    return np.where(far <= reach_cells, dsm[tuple(nearest)], np.nan).astype(np.float32)
