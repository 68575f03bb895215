"""Values of a raster at places."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit


def sample(grid: Grid, array: FloatArray | Float32Array, x: FloatArray, y: FloatArray) -> FloatArray:
    """Bilinear value at world x, y (any shape): cells are values at their centres.

    Missing cells (NaN) leave their weight to the others; NaN where all four are missing or the place lies outside the
    grid. Within half a cell of the grid's edge the border cells go on.

    >>> sample(Grid(0, 2, 1, 2, 2), np.array([[0.0, 1.0], [2.0, 3.0]]), np.array([1.0]), np.array([1.0]))
    array([1.5])
    """
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    place = (float(grid.x_min), float(grid.y_max), float(grid.cell))  # whole numbers would be compiled once more
    found = _sampled(
        np.ascontiguousarray(array), place, np.ascontiguousarray(x.ravel()), np.ascontiguousarray(y.ravel())
    )
    return np.asarray(found.reshape(x.shape))


@njit(cache=True, nogil=True)
def _sampled(
    array: FloatArray | Float32Array, place: tuple[float, float, float], x: FloatArray, y: FloatArray
) -> FloatArray:
    rows, cols = array.shape
    out = np.full(len(x), np.nan)
    tolerance = 0.5 + 1e-6
    for k in range(len(x)):
        col, row = (x[k] - place[0]) / place[2] - 0.5, (place[1] - y[k]) / place[2] - 0.5
        if col < -tolerance or row < -tolerance or col > cols - 1 + tolerance or row > rows - 1 + tolerance:
            continue
        col, row = (
            0.0 if np.isnan(col) else min(max(col, 0.0), cols - 1.0),
            0.0 if np.isnan(row) else min(max(row, 0.0), rows - 1.0),
        )
        c_0, r_0 = min(int(col), max(cols - 2, 0)), min(int(row), max(rows - 2, 0))
        d_c, d_r = col - c_0, row - r_0
        total, weight = 0.0, 0.0
        for i in range(2):
            for j in range(2):
                value = float(array[min(r_0 + i, rows - 1), min(c_0 + j, cols - 1)])
                if not np.isnan(value):
                    w = (d_r if i else 1 - d_r) * (d_c if j else 1 - d_c)
                    total, weight = total + w * value, weight + w
        if weight > 1e-9:
            out[k] = total / weight
    return out
