"""A raster of the uppermost LiDAR points, with planes between them."""

from __future__ import annotations

from contextlib import suppress

import cv2
import numpy as np
from scipy.spatial import QhullError

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.local_frame import LocalFrame
from cityflow.core.points import HIGH_NOISE, HIGH_VEGETATION, LOW_NOISE
from cityflow.core.splitting import FrameRasters, SplitEvidence

CELL_M, REACH_M, AROUND_M = 0.2, 1.6, 2.0
LEAST_DENSITY_M2 = 1.0
NO_ROOF = (3, 4, HIGH_VEGETATION, LOW_NOISE, HIGH_NOISE)
"""Classes that no roof has: vegetation and noise."""


def from_points(evidence: SplitEvidence) -> FrameRasters:
    """The nadir raster laid anew from the points, fine enough for the edges of roofs; the given one where there are few."""
    points = evidence.points
    if points is None or evidence.frames[0].ortho is not None:
        return evidence.frames[0]
    xyz, bounds = points.xyz[~np.isin(points.classification, NO_ROOF)], grown(evidence.outline.bounds, AROUND_M)
    few = len(xyz) < LEAST_DENSITY_M2 * (bounds[2] - bounds[0]) * (bounds[3] - bounds[1])
    return evidence.frames[0] if few else lidar_raster(xyz, bounds, CELL_M, REACH_M)


def lidar_raster(xyz: FloatArray, bounds: Bounds, cell: float, reach_m: float) -> FrameRasters:
    """Heights at the centres of cells from the triangles between the highest points; NaN further than `reach_m` from any cell that has one.

    Parameters
    ----------
    xyz : (N, 3) world metres
    """
    from scipy.interpolate import LinearNDInterpolator  # takes long to load

    grid = Grid.covering(bounds, cell)
    top = highest_points(xyz, grid)
    dsm = np.full(grid.shape, np.nan, np.float32)
    if len(top) >= 4:
        with suppress(QhullError):  # all points on one line: no surface
            x, y = np.meshgrid(grid.x_centres() - grid.x_min, grid.y_centres() - grid.y_max)
            dsm[:] = LinearNDInterpolator(top[:, :2] - (grid.x_min, grid.y_max), top[:, 2])(x, y)
        dsm[_far(grid, top, reach_m)] = np.nan
    return FrameRasters(LocalFrame("lidar", np.eye(3), np.zeros(3)), grid, dsm)


def _far(grid: Grid, top: FloatArray, reach_m: float) -> BoolArray:
    """Cells far from all that have a point."""
    empty = np.ones(grid.shape, np.uint8)
    empty[grid.indices(top[:, 0], top[:, 1])] = 0
    return np.asarray(cv2.distanceTransform(empty, cv2.DIST_L2, cv2.DIST_MASK_5) * grid.cell > reach_m)


def highest_points(xyz: FloatArray, grid: Grid) -> FloatArray:
    """(M, 3) the highest point of each cell of the grid that has any."""
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = np.flatnonzero((row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols))
    cell = row[inside] * grid.cols + col[inside]
    order = np.lexsort((-xyz[inside, 2], cell))
    first = np.r_[True, cell[order][1:] != cell[order][:-1]] if len(order) else np.empty(0, bool)
    return xyz[inside[order[first]]]
