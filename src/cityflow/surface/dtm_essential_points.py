"""Terrain by essential points, as Gross et al. 2005 (§2.1).

Where the surface jumps there is an essential point; it takes the lowest height around it, which is the ground beside
the wall. Between essential points the height runs linearly, along rows and along columns; the mean of both, smoothed,
is the terrain.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import gaussian_filter, minimum_filter

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface.ground_points import lowest_surface, resample, slope_of, work_grid

NEIGHBOURHOOD_M = 9.0
"""Window of the minimum that replaces an essential cell, metres; set by hand, as are the next two: the paper names no values."""
EVERY_M = 12.0
"""Level ground has an essential point this often, metres."""
SMOOTH_M = 1.5
"""Radius of the final convolution (sigma), metres."""


class EssentialPointsParameters(Parameters):
    """Essential points and what is interpolated between them."""

    gradient: float = Field(0.9, gt=0, le=20, description="a cell is essential above this gradient magnitude")
    rise_m: float = Field(
        1.2, gt=0, le=10, description="a stretch that is higher above the ground at one end is not ground, metres"
    )

    @property
    def halo_m(self) -> float:
        """An interpolated line ends at the next essential points: at most a large building away."""
        return 60.0 + EVERY_M


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: EssentialPointsParameters) -> FloatArray:
    """(rows, cols) terrain at the cell centres of `grid`, metres; `dsm` is not needed: last returns say more."""
    del dsm
    work = work_grid(grid)
    surface = lowest_surface(points, work)
    by_rows = along_rows(surface, work, parameters)
    by_columns = along_rows(np.ascontiguousarray(surface.T), _transposed(work), parameters).T
    mean = (by_rows + by_columns) / 2
    return resample(gaussian_filter(mean, SMOOTH_M / work.cell, mode="nearest"), work, grid)


def along_rows(surface: FloatArray, grid: Grid, p: EssentialPointsParameters) -> FloatArray:
    """Terrain by interpolation along the rows; first and last row and column are interpolated in advance."""
    heights, jump = essential_points(surface, grid, p)
    step = max(round(EVERY_M / grid.cell), 1)
    first = step - round(grid.x_min / grid.cell) % step
    essential = _with_level_points(surface, heights, jump, p.rise_m, (first % step, step))
    heights, essential = _prepare_border(heights, essential)
    return np.asarray(_between(heights, essential))


def essential_points(surface: FloatArray, grid: Grid, p: EssentialPointsParameters) -> tuple[FloatArray, BoolArray]:
    """The surface with essential points lowered to the least height around them, and which cells are essential."""
    jump = slope_of(surface, grid.cell) > p.gradient
    low = minimum_filter(surface, 2 * round(NEIGHBOURHOOD_M / grid.cell / 2) + 1, mode="nearest")
    return np.where(jump, low, surface), jump


@njit(cache=True, nogil=True)
def _with_level_points(
    surface: FloatArray, heights: FloatArray, jump: BoolArray, rise: float, lattice: tuple[int, int]
) -> BoolArray:
    """Essential points, and cells of a lattice on those stretches between jumps that do not stand above both ends.

    Without them, level ground with no jump far and wide would leave the interpolation nothing to hold on to.
    """
    rows, cols = surface.shape
    first, step = lattice
    essential = jump.copy()
    for r in range(rows):
        start = 0
        while start < cols:
            if jump[r, start]:
                start += 1
                continue
            end = start
            while end + 1 < cols and not jump[r, end + 1]:
                end += 1
            above_left = start > 0 and surface[r, start] - heights[r, start - 1] > rise
            above_right = end < cols - 1 and surface[r, end] - heights[r, end + 1] > rise
            if not (above_left or above_right):
                for c in range(first, cols, step):
                    if start <= c <= end:
                        essential[r, c] = True
                essential[r, start] = essential[r, end] = True
            start = end + 1
    return essential


def _transposed(grid: Grid) -> Grid:
    """The grid of the transposed raster, as far as its lattice matters."""
    return Grid(-grid.y_max, -grid.x_min, grid.cell, grid.cols, grid.rows)


def _prepare_border(heights: FloatArray, essential: BoolArray) -> tuple[FloatArray, BoolArray]:
    heights, essential = heights.copy(), essential.copy()
    for line in (np.s_[0, :], np.s_[-1, :], np.s_[:, 0], np.s_[:, -1]):
        heights[line] = _between(heights[line][None, :].copy(), essential[line][None, :].copy())[0]
        essential[line] = True
    return heights, essential


@njit(cache=True, nogil=True)
def _between(heights: FloatArray, essential: BoolArray) -> FloatArray:
    """Along each row: linear between essential cells, constant before the first and after the last."""
    rows, cols = heights.shape
    out = heights.copy()
    for r in range(rows):
        last = -1
        for c in range(cols):
            if not essential[r, c]:
                continue
            if last < 0:
                out[r, :c] = heights[r, c]
            for k in range(last + 1, c):
                if last >= 0:
                    out[r, k] = heights[r, last] + (heights[r, c] - heights[r, last]) * (k - last) / (c - last)
            last = c
        if last >= 0:
            out[r, last + 1 :] = heights[r, last]
    return out
