"""A raster of the uppermost LiDAR points, with planes between them."""

from __future__ import annotations

from contextlib import suppress

import cv2
import numpy as np
from scipy.spatial import Delaunay, QhullError

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.kernels import njit
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters

FLAT = 1e-9
ON_EDGE = 1e-9
"""Barycentric coordinates this far below zero still lie on a triangle."""


def lidar_raster(xyz: FloatArray, bounds: Bounds, cell: float, reach_m: float) -> FrameRasters:
    """Heights at the centres of cells from the triangles between the highest points; NaN further than `reach_m` from any cell that has one.

    Parameters
    ----------
    xyz : (N, 3) world metres
    """
    grid = Grid.covering(bounds, cell)
    top = highest_points(xyz, grid)
    dsm = np.full(grid.shape, np.nan, np.float32)
    # in cells from the centre of the first one
    at = np.column_stack([(top[:, 0] - grid.x_min) / grid.cell, (grid.y_max - top[:, 1]) / grid.cell]) - 0.5
    if len(top) >= 4:
        with suppress(QhullError):  # all points on one line: no surface
            fill_triangles(np.asarray(Delaunay(at).simplices, np.int64), at, np.ascontiguousarray(top[:, 2]), dsm)
        dsm[_far(grid, top, reach_m)] = np.nan
    return FrameRasters(LocalFrame("lidar", np.eye(3), np.zeros(3)), grid, dsm)


def _far(grid: Grid, top: FloatArray, reach_m: float) -> BoolArray:
    """Cells far from all that have a point."""
    empty = np.ones(grid.shape, np.uint8)
    empty[grid.indices(top[:, 0], top[:, 1])] = 0
    return np.asarray(cv2.distanceTransform(empty, cv2.DIST_L2, cv2.DIST_MASK_5) * grid.cell > reach_m)


@njit(cache=True, nogil=True)
def fill_triangles(triangles: IntArray, at: FloatArray, z: FloatArray, dsm: Float32Array) -> None:
    """Writes the height of each triangle's plane into the cells whose centres lie on it.

    Parameters
    ----------
    triangles : (T, 3) corners, positions in `at`
    at : (N, 2) column and row, 0 at the centre of the first cell;  z : (N,) metres
    dsm : (rows, cols) float32, written to
    """
    rows, cols = dsm.shape
    for k in range(len(triangles)):
        a, b, c = triangles[k]
        x_a, y_a = at[a]
        x_ab, y_ab, x_ac, y_ac = at[b, 0] - x_a, at[b, 1] - y_a, at[c, 0] - x_a, at[c, 1] - y_a
        area = x_ab * y_ac - x_ac * y_ab
        if abs(area) < FLAT:
            continue
        first_row = max(int(np.ceil(y_a + min(0.0, y_ab, y_ac))), 0)
        last_row = min(int(np.floor(y_a + max(0.0, y_ab, y_ac))), rows - 1)
        first_col = max(int(np.ceil(x_a + min(0.0, x_ab, x_ac))), 0)
        last_col = min(int(np.floor(x_a + max(0.0, x_ab, x_ac))), cols - 1)
        for row in range(first_row, last_row + 1):
            for col in range(first_col, last_col + 1):
                dx, dy = col - x_a, row - y_a
                to_b, to_c = (dx * y_ac - x_ac * dy) / area, (x_ab * dy - dx * y_ab) / area
                if to_b >= -ON_EDGE and to_c >= -ON_EDGE and to_b + to_c <= 1.0 + ON_EDGE:
                    dsm[row, col] = z[a] + to_b * (z[b] - z[a]) + to_c * (z[c] - z[a])


def highest_points(xyz: FloatArray, grid: Grid) -> FloatArray:
    """(M, 3) the highest point of each cell of the grid that has any."""
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = np.flatnonzero((row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols))
    cell = row[inside] * grid.cols + col[inside]
    order = np.lexsort((-xyz[inside, 2], cell))
    first = np.r_[True, cell[order][1:] != cell[order][:-1]] if len(order) else np.empty(0, bool)
    return xyz[inside[order[first]]]
