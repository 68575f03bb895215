"""Heights of a raster at points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid


def sample(grid: Grid, array: NDArray[np.floating], x: FloatArray, y: FloatArray) -> FloatArray:
    """Bilinear between cell centres; cells without a value are left out and the weights of the others scaled up.

    Parameters
    ----------
    array : (rows, cols) of `grid`, NaN where there is no value
    x, y : (N,) world metres

    Returns
    -------
    (N,) float64; NaN where none of the four cells around a point has a value, or the point lies outside the grid

    >>> sample(Grid(0.0, 2.0, 1.0, 2, 2), np.array([[0.0, 1.0], [2.0, 3.0]]), np.array([1.0]), np.array([1.0]))
    array([1.5])
    """
    u, v = (np.asarray(x) - grid.x_min) / grid.cell - 0.5, (grid.y_max - np.asarray(y)) / grid.cell - 0.5
    col, row = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    total, weight = np.zeros(len(u)), np.zeros(len(u))
    for d_row, w_row in ((0, 1 - (v - row)), (1, v - row)):
        for d_col, w_col in ((0, 1 - (u - col)), (1, u - col)):
            z = array[np.clip(row + d_row, 0, grid.rows - 1), np.clip(col + d_col, 0, grid.cols - 1)].astype(np.float64)
            w = np.where(np.isfinite(z), w_row * w_col, 0.0)
            total += np.where(w > 0, w * z, 0.0)
            weight += w
    inside = (u > -0.5 - 1e-9) & (u < grid.cols - 0.5 + 1e-9) & (v > -0.5 - 1e-9) & (v < grid.rows - 0.5 + 1e-9)
    return np.where(inside & (weight > 1e-12), total / np.where(weight > 0, weight, 1.0), np.nan)
