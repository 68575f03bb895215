"""Terrain by essential points, as Gross et al. 2005 (§2.1).

Where the surface jumps there is an essential point; it takes the lowest height around it, which is the ground beside
the wall. Between essential points the height runs linearly, along rows and along columns; the mean of both, smoothed,
is the terrain.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from pydantic import Field
from scipy.ndimage import binary_dilation, gaussian_filter, minimum_filter

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface.ground_points import lowest_surface, resample, slope_of, work_grid


class EssentialPointsParameters(Parameters):
    """Essential points and what is interpolated between them."""

    work_cell_m: float = Field(1.0, ge=0.25, le=5, description="cells of the surface, metres")
    gradient: float = Field(0.9, gt=0, le=20, description="a cell is essential above this gradient magnitude")
    neighbourhood_m: float = Field(9.0, ge=1, le=100, description="window of the minimum that replaces it, metres")
    every_m: float = Field(12.0, ge=1, le=200, description="level ground has an essential point this often, metres")
    rise_m: float = Field(
        1.2, gt=0, le=10, description="a point above the window's minimum by more is no ground, metres"
    )
    window_m: float = Field(61.0, ge=5, le=300, description="window in which a level point must be low, metres")
    smooth_m: float = Field(1.5, ge=0, le=50, description="radius of the final convolution (sigma), metres")

    @property
    def halo_m(self) -> float:
        """An interpolated line ends at the next essential points: at most a large building away."""
        return self.window_m + self.every_m


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: EssentialPointsParameters) -> FloatArray:
    """(rows, cols) terrain at the cell centres of `grid`, metres; `dsm` is not needed: last returns say more."""
    del dsm
    work = work_grid(grid, parameters.work_cell_m)
    surface = lowest_surface(points, work)
    heights, essential = essential_points(surface, work, parameters)
    heights, essential = _prepare_border(heights, essential)
    by_rows = _between(heights, essential)
    by_columns = _between(np.ascontiguousarray(heights.T), np.ascontiguousarray(essential.T)).T
    mean = (by_rows + by_columns) / 2
    return resample(gaussian_filter(mean, parameters.smooth_m / work.cell, mode="nearest"), work, grid)


def essential_points(surface: FloatArray, grid: Grid, p: EssentialPointsParameters) -> tuple[FloatArray, BoolArray]:
    """Heights and mask of essential points: jumps (with the lowest height near by), and low places without jumps.

    Level ground without any jump would leave the interpolation nothing to hold on to; so places on a world lattice
    that are not above their surroundings are essential too.
    """

    def window(metres: float) -> int:
        return 2 * round(metres / grid.cell / 2) + 1

    jump = slope_of(surface, grid.cell) > p.gradient
    low = minimum_filter(surface, window(p.neighbourhood_m), mode="nearest")
    wide = minimum_filter(surface, window(p.window_m), mode="nearest")
    smooth_floor = gaussian_filter(wide, p.window_m / grid.cell / 4, mode="nearest")
    beside_jump = binary_dilation(jump, iterations=1)
    step = max(round(p.every_m / grid.cell), 1)
    rows = np.arange(grid.rows) - round(grid.y_max / grid.cell)
    cols = np.arange(grid.cols) + round(grid.x_min / grid.cell)
    lattice = (rows % step == 0)[:, None] | (cols % step == 0)[None, :]
    level = lattice & ~beside_jump & (surface - np.maximum(low, smooth_floor) < p.rise_m)
    ground_jump = jump & (low - smooth_floor < 3 * p.rise_m)
    return np.where(jump, low, surface), ground_jump | level


def _prepare_border(heights: FloatArray, essential: BoolArray) -> tuple[FloatArray, BoolArray]:
    """First and last rows and columns are interpolated in advance and then count as essential throughout."""
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
