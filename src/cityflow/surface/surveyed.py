"""The surveyed area: within reach of points on all sides.

The morphological closing of the cells with points: holes narrower than twice the reach (canals, shadows, dark roofs)
belong to the survey, what lies outside its outline does not. Where points are so few that they may be blunders of matching
(specks in the rim of pictures, far from all the rest) nothing was surveyed. A cell's answer depends on points within
three times the reach, so it is the same in every tiling.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import distance_transform_edt, uniform_filter

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.surface.ground_points import WORK_CELL_M


class SurveyedParameters(Parameters):
    """How wide a hole in the survey may be."""

    reach_m: float = Field(20.0, ge=1, le=200, description="holes narrower than twice this are surveyed, metres")
    least_share: float = Field(
        0.0, ge=0, le=1, description="points count if at least this share of the cells within reach has points"
    )

    @property
    def halo_m(self) -> float:
        """A closing looks as far as its dilation and its erosion together; and the share of cells, as far as the reach."""
        return (3 if self.least_share else 2) * self.reach_m + 2 * WORK_CELL_M


def surveyed(count: IntArray, grid: Grid, parameters: SurveyedParameters) -> BoolArray:
    """(rows, cols) True inside the survey; `count` (rows, cols) points per cell of `grid`."""
    p = parameters
    if not count.any():
        return np.zeros(grid.shape, bool)
    work = Grid.covering(grid.bounds, WORK_CELL_M)
    row = np.floor((work.y_max - grid.y_centres()) / work.cell).astype(np.int64)
    col = np.floor((grid.x_centres() - work.x_min) / work.cell).astype(np.int64)
    counted = np.zeros(work.shape, bool)
    filled_row, filled_col = np.nonzero(count)
    counted[row[filled_row], col[filled_col]] = True
    if p.least_share:
        counted &= _dense(counted, round(p.reach_m / work.cell), p.least_share)
    return np.asarray(closed(counted, p.reach_m / work.cell)[np.ix_(row, col)])


def _dense(counted: BoolArray, reach: int, least_share: float) -> BoolArray:
    """(rows, cols) True where the square within the reach has enough cells with points."""
    around = uniform_filter(counted.astype(float), 2 * reach + 1, mode="constant")
    return np.asarray(around >= least_share - 1e-9)


def closed(mask: BoolArray, radius: float) -> BoolArray:
    """(rows, cols) closing by a disc of `radius` cells; beyond the array nothing is set."""
    border = int(np.ceil(radius)) + 1
    near = distance_transform_edt(~np.pad(mask, border)) <= radius
    # One more cell of nothing: else a dilation that fills the padded array would find no outside to erode from.
    kept = distance_transform_edt(np.pad(near, 1))[1:-1, 1:-1] > radius
    inner = slice(border, -border)
    return np.asarray(kept[inner, inner] | mask)
