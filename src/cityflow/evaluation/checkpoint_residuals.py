"""Residuals at points of known coordinates: heights of the surface, and places in the true ortho."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Grid


def ortho_shift(xyz: FloatArray, height: FloatArray, ortho_centres: FloatArray) -> FloatArray:
    """(N, 2) metres by which an ortho shows points (N, 3) off their place where its surface is (N,) `height` above them."""
    to_camera = ortho_centres - xyz
    return np.asarray(height[:, None] * to_camera[:, :2] / to_camera[:, 2:])


def heights_at(dsm: FloatArray | Float32Array, grid: Grid, xy: FloatArray) -> FloatArray:
    """(N,) bilinear heights at places (N, 2); NaN outside, and where one of the four cells around is a hole: no step is averaged away."""
    col, row = (xy[:, 0] - grid.x_min) / grid.cell - 0.5, (grid.y_max - xy[:, 1]) / grid.cell - 0.5
    inside = (col >= 0) & (row >= 0) & (col <= grid.cols - 1) & (row <= grid.rows - 1)
    found = np.full(len(xy), np.nan)
    c, r = col[inside], row[inside]
    c_0, r_0 = np.minimum(c.astype(np.int64), grid.cols - 2), np.minimum(r.astype(np.int64), grid.rows - 2)
    d_c, d_r = c - c_0, r - r_0
    z = np.asarray(dsm, np.float64)
    upper = z[r_0, c_0] * (1 - d_c) + z[r_0, c_0 + 1] * d_c
    lower = z[r_0 + 1, c_0] * (1 - d_c) + z[r_0 + 1, c_0 + 1] * d_c
    found[inside] = upper * (1 - d_r) + lower * d_r
    return found
