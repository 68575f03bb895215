"""Values of a raster at places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Grid


def sample(grid: Grid, array: FloatArray | Float32Array, x: FloatArray, y: FloatArray) -> FloatArray:
    """Bilinear value at world x, y (any shape): cells are values at their centres.

    Missing cells (NaN) leave their weight to the others; NaN where all four are missing or the place lies outside the
    grid. Within half a cell of the grid's edge the border cells go on.

    >>> sample(Grid(0, 2, 1, 2, 2), np.array([[0.0, 1.0], [2.0, 3.0]]), np.array([1.0]), np.array([1.0]))
    array([1.5])
    """
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    col, row = (x - grid.x_min) / grid.cell - 0.5, (grid.y_max - y) / grid.cell - 0.5
    tolerance = 0.5 + 1e-6
    outside = (col < -tolerance) | (row < -tolerance) | (col > grid.cols - 1 + tolerance)
    outside |= row > grid.rows - 1 + tolerance
    col, row = np.clip(np.nan_to_num(col), 0, grid.cols - 1), np.clip(np.nan_to_num(row), 0, grid.rows - 1)
    c_0, r_0 = (
        np.minimum(col.astype(np.int64), max(grid.cols - 2, 0)),
        np.minimum(row.astype(np.int64), max(grid.rows - 2, 0)),
    )
    d_c, d_r = col - c_0, row - r_0
    total, weight = np.zeros(x.shape), np.zeros(x.shape)
    for i, w_r in ((0, 1 - d_r), (1, d_r)):
        for j, w_c in ((0, 1 - d_c), (1, d_c)):
            value = array[np.minimum(r_0 + i, grid.rows - 1), np.minimum(c_0 + j, grid.cols - 1)].astype(np.float64)
            w: NDArray[np.float64] = np.where(np.isnan(value), 0.0, w_r * w_c)
            total, weight = total + w * np.nan_to_num(value), weight + w
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(outside | (weight <= 1e-9), np.nan, total / weight)
