"""The working rasters of a drawn survey: heights above terrain, classes, counts and holes on cells of 0.4 m."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import minimum_filter
from scipy.special import ndtr

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, GROUND, HIGH_VEGETATION
from cityflow.synthetic.town import Town
from scenes.drawn_frames import DrawnFrame
from scenes.drawn_heights import LEAVES
from scenes.drawn_noise import smooth_noise

LEAST_SHARE = 0.25
HIGH_M = 2.0
PATCH_M = 1.2
"""Foliage is overlooked in patches about twice as wide."""


@dataclass(frozen=True, slots=True)
class DrawnSurface:
    """Rasters of the nadir frame on coarse cells, (rows, cols) each, world grid.

    Attributes
    ----------
    dtm : float64, metres;  ndsm : float32, metres above it, holes filled from the lower side
    klass : uint8 ASPRS;  holes : bool;  count : uint32 points
    """

    grid: Grid
    dtm: FloatArray
    ndsm: Float32Array
    klass: ByteArray
    holes: BoolArray
    count: np.ndarray[tuple[int, int], np.dtype[np.uint32]]


def drawn_surface(town: Town, nadir: DrawnFrame, factor: int = 5, recall: float = 0.6, seed: int = 0) -> DrawnSurface:
    """Coarse rasters of a drawn nadir frame, as the stage of surfaces would make them.

    Parameters
    ----------
    factor : fine cells along the edge of a coarse one; the local frame's grid must lie on that lattice
    recall : share of high foliage that is recognised
    """
    fine, origin = nadir.rasters.grid, nadir.rasters.frame.origin
    grid = Grid(
        fine.x_min + origin[0], fine.y_max + origin[1], fine.cell * factor, fine.rows // factor, fine.cols // factor
    )
    blocks = _blocks(nadir.rasters.dsm, factor)
    known = np.isfinite(blocks).sum(axis=2)
    median = _upper_median(blocks, known, LEAST_SHARE * factor * factor)
    x, y = grid.centres()
    dtm = town.dtm(x, y)
    ndsm = (_filled_low(median) - dtm).astype(np.float32)
    green = (_blocks(nadir.kind == LEAVES, factor).mean(axis=2) > 0.5) & (ndsm > HIGH_M)
    noticed = ndtr(smooth_noise(grid, seed + 900, PATCH_M / grid.cell)) < recall
    klass = np.where(ndsm > HIGH_M, BUILDING, GROUND)
    klass[green & noticed] = HIGH_VEGETATION
    return DrawnSurface(grid, dtm, ndsm, klass.astype(np.uint8), np.isnan(median), (3 * known).astype(np.uint32))


def _blocks(values: np.ndarray, factor: int) -> np.ndarray:
    rows, cols = values.shape[0] // factor, values.shape[1] // factor
    cut = values[: rows * factor, : cols * factor].reshape(rows, factor, cols, factor)
    return cut.transpose(0, 2, 1, 3).reshape(rows, cols, factor * factor)


def _upper_median(blocks: np.ndarray, known: np.ndarray, least: float) -> FloatArray:
    ordered = np.sort(blocks, axis=2)  # NaN last
    middle = np.take_along_axis(ordered, np.minimum(known // 2, blocks.shape[2] - 1)[..., None], axis=2)[..., 0]
    return np.asarray(np.where(known >= max(least, 1.0), middle, np.nan), np.float64)


def _filled_low(heights: FloatArray) -> FloatArray:
    """Holes grown over from their rim, the lowest neighbour first."""
    filled = heights.copy()
    while np.isnan(filled).any() and np.isfinite(filled).any():
        low = minimum_filter(np.where(np.isnan(filled), np.inf, filled), 3)
        filled = np.where(np.isnan(filled) & np.isfinite(low), low, filled)
    return filled
