"""Residuals at points of known coordinates: heights of the surface, and places in the true ortho."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.evaluation.statistics import ErrorStatistics, error_statistics


@dataclass(frozen=True, slots=True)
class CheckpointResiduals:
    """What was found at the checkpoints; NaN where there is no surface.

    Attributes
    ----------
    height : (N,) surface minus checkpoint, metres
    place : (N, 2) where the ortho shows a checkpoint, minus where it is, east and north, metres; NaN without an ortho
    heights, east, north : statistics of these
    """

    height: FloatArray
    place: FloatArray
    heights: ErrorStatistics
    east: ErrorStatistics
    north: ErrorStatistics


def checkpoint_residuals(
    xyz: FloatArray, dsm: FloatArray | Float32Array, grid: Grid, ortho_centres: FloatArray | None = None
) -> CheckpointResiduals:
    """Residuals of DSM and ortho.

    Parameters
    ----------
    xyz : (N, 3) checkpoints, world metres
    dsm : (rows, cols) of `grid`, metres, NaN in holes
    ortho_centres : (N, 3) projection centre of the image that the ortho took its pixel from at each checkpoint, NaN where there is none.
        An ortho puts what lies on the ray of a pixel where the ray meets the surface; a surface too high by d moves it by d times the ray's
        horizontal over its vertical part, towards the image's nadir.
    """
    height = heights_at(dsm, grid, xyz[:, :2]) - xyz[:, 2]
    place = np.full((len(xyz), 2), np.nan) if ortho_centres is None else ortho_shift(xyz, height, ortho_centres)
    return CheckpointResiduals(
        height, place, error_statistics(height), error_statistics(place[:, 0]), error_statistics(place[:, 1])
    )


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
