"""Terrain by a cloth that is pressed against the surface from below, from coarse to fine.

The cloth rises by small steps, is evened out after each, and cannot pass the lowest heights: it bridges buildings and
follows hills. It is too stiff for crests and banks: what stands above it but flows into the ground beside it is given
back, as `dtm_windows` does. After Zhang et al. 2016 (cloth simulation), on a pyramid of minima as Lallement et al. 2022 (bulldozer).
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import uniform_filter

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface.dtm_windows import WindowsParameters, without_terrain
from cityflow.surface.gridding import bridge_gaps
from cityflow.surface.ground_points import lowest_surface, refine, work_grid
from cityflow.surface.rasterise import count_points


class ClothParameters(Parameters):
    """How the cloth moves."""

    work_cell_m: float = Field(1.0, ge=0.25, le=5, description="finest cells of the cloth, metres")
    largest_window_m: float = Field(
        60.0, ge=5, le=300, description="the coarsest cells: half of a large building, metres"
    )
    curvature_per_m: float = Field(0.06, gt=0, le=1, description="the cloth bends no more than this, 1/metres")
    steps: int = Field(14, ge=1, le=500, description="steps on each level")
    clear_m: float = Field(0.3, gt=0, le=5, description="what stands above the cloth by more is an object, metres")
    near_m: float = Field(0.15, gt=0, le=5, description="a point this near to the cloth is ground, metres")
    near_slope: float = Field(0.6, ge=0, le=5, description="and that much further per unit of slope, metres")

    @property
    def halo_m(self) -> float:
        """Reach of the coarsest cells, which carry the farthest."""
        return 2 * self.largest_window_m


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: ClothParameters) -> FloatArray:
    """(rows, cols) terrain at the cell centres of `grid`, metres; `dsm` is not needed by this method."""
    del dsm
    p = parameters
    work = work_grid(grid, p.work_cell_m)
    low = lowest_surface(points, work)
    measured = count_points(points, work) > 0
    raised = low - drape(low, work, p) > p.clear_m
    objects = without_terrain(low, raised.astype(np.int64), measured, WindowsParameters(work_cell_m=p.work_cell_m))
    rough = bridge_gaps(np.where(objects | ~measured, np.nan, low), work)
    return refine(points, rough, work, grid, (p.near_m, p.near_slope))


def drape(surface: FloatArray, grid: Grid, p: ClothParameters) -> FloatArray:
    """(rows, cols) height of the cloth below `surface`, metres."""
    levels = max(int(np.log2(p.largest_window_m / 2 / p.work_cell_m)), 0)
    pyramid = [_minima(surface, grid, 2**level) for level in range(levels + 1)]
    cloth = pyramid[-1]
    for level in range(levels, -1, -1):
        low, offset = pyramid[level], _offset(grid, 2**level)
        if level < levels:
            cloth = _finer(cloth, _offset(grid, 2 ** (level + 1)), offset, low.shape)
        cloth = np.minimum(cloth, low)
        # Evening out lowers a surface of this curvature by as much as the step raises it.
        rise = p.curvature_per_m * (2**level * p.work_cell_m) ** 2 * 2 / 3
        for _ in range(p.steps):
            cloth = np.minimum(uniform_filter(cloth + rise, 3, mode="nearest"), low)
    return cloth


def _offset(grid: Grid, factor: int) -> tuple[int, int]:
    """Rows and columns by which the first coarse cell, on the world lattice, starts before the grid."""
    row, col = -round(grid.y_max / grid.cell), round(grid.x_min / grid.cell)
    return row % factor, col % factor


def _minima(surface: FloatArray, grid: Grid, factor: int) -> FloatArray:
    row, col = _offset(grid, factor)
    pad_r, pad_c = -(grid.rows + row) % factor, -(grid.cols + col) % factor
    padded = np.pad(surface, ((row, pad_r), (col, pad_c)), mode="edge")
    blocks = padded.reshape(padded.shape[0] // factor, factor, padded.shape[1] // factor, factor)
    return np.asarray(blocks.min(axis=(1, 3)))


def _finer(
    coarse: FloatArray, offset: tuple[int, int], fine_offset: tuple[int, int], shape: tuple[int, int]
) -> FloatArray:
    """The coarse cloth at the next finer cells, linear between centres."""
    factor_rows = (np.arange(shape[0]) + 0.5) / 2 - 0.5 + _shift(offset[0], fine_offset[0])
    factor_cols = (np.arange(shape[1]) + 0.5) / 2 - 0.5 + _shift(offset[1], fine_offset[1])
    by_rows = _linear(coarse, factor_rows)
    return _linear(by_rows.T, factor_cols).T


def _shift(coarse: int, fine: int) -> float:
    """Half a coarse cell where the finer raster starts in the second half of the first coarse one."""
    return 0.5 if coarse > fine else 0.0


def _linear(values: FloatArray, at: FloatArray) -> FloatArray:
    at = np.clip(at, 0, len(values) - 1)
    low = np.minimum(at.astype(np.int64), max(len(values) - 2, 0))
    share = (at - low)[:, None]
    return np.asarray(values[low] * (1 - share) + values[np.minimum(low + 1, len(values) - 1)] * share)
