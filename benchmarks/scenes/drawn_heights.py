"""True heights spoilt as dense matching spoils them: rounded creases, noise, widened and frayed edges, sunken crowns, bridged gaps, holes."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import Field
from scipy.special import ndtr

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from scenes.drawn_noise import smooth_noise

FLAT, UPRIGHT, LEAVES = range(3)
STEP_M = 0.6
"""Lower steps are rounded off, higher ones widened."""
PATCH_CELLS = 8.0
"""What happens to an edge, a gap or a crown happens to patches of about twice this size alike."""
HEAVY = 0.5
"""How much the noise differs from place to place (of its logarithm): tails longer than normal, the same median."""
BRIDGED, MISSING = 0.45, 0.8
"""Of a narrow gap, the share shown too high, and the share that is that or has no height at all."""
FRAYED_CELLS = 3
"""So far below a step, at most, cells are missing."""


class HeightNoise(Parameters):
    """How much worse than the truth a matched surface is. What is given in GSD counts in cells of the frame."""

    level_gsd: float = Field(0.35, ge=0, le=10, description="noise of heights on roofs and ground (NMAD), GSD")
    facade_gsd: float = Field(1.1, ge=0, le=10, description="noise across façades in tilted local frames (NMAD), GSD")
    fine_cells: float = Field(1.2, ge=0, le=20, description="Gaussian that the finer noise is smoothed with, cells")
    coarse_cells: float = Field(6.0, ge=0, le=50, description="Gaussian that the coarser noise is smoothed with, cells")
    coarse_share: float = Field(0.7, ge=0, le=1, description="share of the noise's variance that is coarse")
    rounded_cells: float = Field(
        2.0, ge=0, le=20, description="Gaussian that creases and low steps are rounded with, cells"
    )
    widened_cells: float = Field(1.2, ge=0, le=5, description="what stands in front is this much wider, at most, cells")
    frayed: float = Field(0.25, ge=0, le=1, description="share of cells just below a step that have no height")
    leaf_m: float = Field(0.4, ge=0, le=5, description="noise on foliage, metres")
    leaf_missing: float = Field(0.3, ge=0, le=1, description="share of foliage without a height")
    leaf_sunk: float = Field(0.1, ge=0, le=1, description="share of foliage that shows what lies behind it")
    gap_m: float = Field(1.6, ge=0, le=10, description="gaps narrower than this are bridged or missing in part, metres")
    slit_m: float = Field(0.6, ge=0, le=10, description="gaps narrower than this are bridged, metres")
    dark_missing: float = Field(
        0.02, ge=0, le=1, description="share of places in shadow without texture that have no height"
    )
    bland: float = Field(1.2, ge=0, le=100, description="contrast below which there is no texture, grey values of 255")


@dataclass(frozen=True, slots=True)
class TrueView:
    """What is true of a local frame's cells, (rows, cols) each.

    Attributes
    ----------
    grid : of the local frame
    height : float64, local frame metres; NaN where there is nothing;  behind : the same without trees
    kind : uint8, `FLAT`, `UPRIGHT` or `LEAVES`
    dark : bool, in shadow;  contrast : float32, standard deviation of grey values around
    """

    grid: Grid
    height: FloatArray
    behind: FloatArray
    kind: ByteArray
    dark: BoolArray
    contrast: Float32Array


def matched_heights(true: TrueView, noise: HeightNoise, seed: int) -> Float32Array:
    """(rows, cols) float32 heights as matching would leave them; NaN where it finds nothing."""
    known = np.isfinite(true.height)
    low = float(np.nanmin(true.height)) if known.any() else 0.0
    kind, exact = _sunk(true, low, noise, seed)
    leaves = (kind == LEAVES).astype(np.uint8)
    height = _closed_crowns(exact, leaves.astype(bool))
    height, hole = _gaps_bridged(height, true.grid, noise, seed)
    height, moved = _widened(_rounded_off(height, true.grid, noise), true.grid, noise, seed)
    hole |= _frayed(height, true.grid, noise, seed)
    green = np.where(moved, cv2.dilate(leaves, np.ones((5, 5), np.uint8)), leaves).astype(bool)
    height = height + _errors(np.where(green, LEAVES, kind), true.grid, noise, seed)
    hole |= green & (_chance(true.grid, seed + 5, 2.5) < noise.leaf_missing)
    bland = true.dark & (true.contrast < noise.bland)
    hole |= bland & (_chance(true.grid, seed + 6, 3.0) < noise.dark_missing)
    return np.where(known & ~hole, height + np.float32(low), np.float32(np.nan)).astype(np.float32)


def _sunk(true: TrueView, low: float, noise: HeightNoise, seed: int) -> tuple[ByteArray, Float32Array]:
    """Kinds and heights (above `low`) with parts of the foliage looked through."""
    through = (true.kind == LEAVES) & np.isfinite(true.behind)
    through &= _chance(true.grid, seed + 8, PATCH_CELLS / 2) < noise.leaf_sunk
    height = np.where(through, true.behind, true.height)
    kind = np.where(through, FLAT, true.kind).astype(np.uint8)
    return kind, np.where(np.isfinite(height), height - low, 0.0).astype(np.float32)


def _closed_crowns(height: Float32Array, leaves: BoolArray) -> Float32Array:
    """Crowns as a closed skin: no matcher looks between single leaves."""
    ball = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    skin = cv2.blur(cv2.morphologyEx(height, cv2.MORPH_CLOSE, ball), (3, 3))
    return np.where(leaves, skin, height)


def _gaps_bridged(height: Float32Array, grid: Grid, noise: HeightNoise, seed: int) -> tuple[Float32Array, BoolArray]:
    """Heights with narrow gaps raised in patches, and where nothing is found in them."""
    lid = _closed(height, noise.gap_m, grid.cell)
    depth = lid - height
    narrow = depth > np.float32(1.0 + 2.0 * grid.cell)
    slit = narrow & (_closed(height, noise.slit_m, grid.cell) - height > np.float32(1.0))
    chance = _chance(grid, seed + 2, PATCH_CELLS)
    raised = slit & (chance < MISSING) | narrow & (chance < BRIDGED)
    share = np.clip(0.75 + 0.25 * smooth_noise(grid, seed + 3, 2.0), 0.0, 1.0)
    missing = narrow & ~raised & (chance < MISSING)
    return np.where(raised, height + share * depth, height).astype(np.float32), missing | (slit & ~raised)


def _closed(height: Float32Array, width_m: float, cell: float) -> Float32Array:
    """Greyscale closing with a disc of this width: what is narrower is filled up to its lower rim."""
    # an odd number of cells, so that nothing moves aside
    size = 2 * max(0, round((width_m / cell - 1) / 2)) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    return np.asarray(cv2.morphologyEx(height, cv2.MORPH_CLOSE, disc), np.float32)


def _rounded_off(height: Float32Array, grid: Grid, noise: HeightNoise) -> Float32Array:
    """Heights whose creases and low steps are smooth; beside high steps they stay as they are."""
    if noise.rounded_cells == 0:
        return height
    reach = int(np.ceil(2.5 * noise.rounded_cells))
    size = 2 * reach + 1
    soft = cv2.GaussianBlur(height, (size, size), noise.rounded_cells, borderType=cv2.BORDER_REPLICATE)
    disc = _disc(reach)
    spread = cv2.dilate(height, disc) - cv2.erode(height, disc)
    return np.where(spread < _high_step(2 * reach, grid.cell), soft, height)


def _widened(height: Float32Array, grid: Grid, noise: HeightNoise, seed: int) -> tuple[Float32Array, BoolArray]:
    """Heights whose steps stand a random part of a few cells too far out, and which cells changed."""
    reach = noise.widened_cells * _chance(grid, seed + 1, PATCH_CELLS)
    out = height.copy()
    for cells in range(1, int(np.ceil(noise.widened_cells)) + 1):
        wide = cv2.dilate(height, _disc(cells))
        # a part of a cell: so many of the cells, in patches finer than those of the reach
        chosen = reach > cells - 1 + _chance(grid, seed + 10 + cells, 1.0)
        out = np.where(chosen & (wide - height > _high_step(cells, grid.cell)), wide, out)
    return out, out != height


def _frayed(height: Float32Array, grid: Grid, noise: HeightNoise, seed: int) -> BoolArray:
    """Cells just below a step that are missing, the fewer the farther off."""
    hole = np.zeros(height.shape, bool)
    chance = _chance(grid, seed + 9, 1.0)
    for cells in range(1, FRAYED_CELLS + 1 if noise.frayed > 0 else 1):
        below = cv2.dilate(height, _disc(cells)) - height > _high_step(cells, grid.cell)
        hole |= below & (chance < noise.frayed / cells)
    return hole


def _disc(cells: int) -> ByteArray:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * cells + 1, 2 * cells + 1)), np.uint8)


def _high_step(cells: int, cell: float) -> np.float32:
    """Height that no slope of this many cells has, metres."""
    return np.float32(STEP_M + 1.5 * cells * cell)


def _errors(kind: ByteArray, grid: Grid, noise: HeightNoise, seed: int) -> Float32Array:
    """(rows, cols) errors of the heights, metres."""
    fine, coarse = smooth_noise(grid, seed + 4, noise.fine_cells), smooth_noise(grid, seed + 40, noise.coarse_cells)
    shape = np.sqrt(1.0 - noise.coarse_share) * fine + np.sqrt(noise.coarse_share) * coarse
    scale = np.exp(HEAVY * smooth_noise(grid, seed + 7, 2 * PATCH_CELLS))
    # an error along the view shows across an upright wall by the sine of the tilt: 45 degrees
    amount = np.array([noise.level_gsd * grid.cell, noise.facade_gsd * grid.cell * np.sqrt(2.0), noise.leaf_m])
    return np.asarray(np.where(kind == LEAVES, fine, shape) * scale * amount[kind], np.float32)


def _chance(grid: Grid, seed: int, sigma_cells: float) -> Float32Array:
    """(rows, cols) numbers between 0 and 1, evenly distributed, the same over patches."""
    return np.asarray(ndtr(smooth_noise(grid, seed, sigma_cells)), np.float32)
