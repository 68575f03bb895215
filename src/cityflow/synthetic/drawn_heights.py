"""True heights spoilt as dense matching spoils them: noise, widened edges, rough and missing foliage, bridged gaps, holes."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import Field
from scipy.special import ndtr

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.synthetic.drawn_noise import smooth_noise

FLAT, UPRIGHT, LEAVES = range(3)
STEP_M = 0.6
"""Lower steps are not widened: matching blurs them within its noise."""
PATCH_CELLS = 8.0
"""What happens to an edge, a gap or a crown happens to patches of about twice this size alike."""
HEAVY = 0.35
"""How much the noise differs from place to place (of its logarithm): tails longer than normal, the same median."""
BRIDGED, MISSING = 0.45, 0.8
"""Of a narrow gap, the share shown too high, and the share that is that or has no height at all."""


class HeightNoise(Parameters):
    """How much worse than the truth a matched surface is. What is given in GSD counts in cells of the frame."""

    level_gsd: float = Field(0.15, ge=0, le=10, description="noise of heights on roofs and ground (NMAD), GSD")
    facade_gsd: float = Field(1.35, ge=0, le=10, description="noise across façades in tilted frames (NMAD), GSD")
    smooth_cells: float = Field(1.2, ge=0, le=20, description="Gaussian that the noise is smoothed with, cells")
    widened_cells: float = Field(1.5, ge=0, le=5, description="what stands in front is this much wider, at most, cells")
    leaf_m: float = Field(0.4, ge=0, le=5, description="noise on foliage, metres")
    leaf_missing: float = Field(0.3, ge=0, le=1, description="share of foliage without a height")
    gap_m: float = Field(2.0, ge=0, le=10, description="gaps narrower than this are bridged or missing in part, metres")
    slit_m: float = Field(0.8, ge=0, le=10, description="gaps narrower than this are bridged, metres")
    dark_missing: float = Field(
        0.35, ge=0, le=1, description="share of places in shadow without texture that have no height"
    )
    bland: float = Field(1.2, ge=0, le=100, description="contrast below which there is no texture, grey values of 255")


@dataclass(frozen=True, slots=True)
class TrueView:
    """What is true of a frame's cells, (rows, cols) each.

    Attributes
    ----------
    grid : of the frame
    height : float64, frame metres; NaN where there is nothing
    kind : uint8, `FLAT`, `UPRIGHT` or `LEAVES`
    dark : bool, in shadow;  contrast : float32, standard deviation of grey values around
    """

    grid: Grid
    height: FloatArray
    kind: np.ndarray[tuple[int, int], np.dtype[np.uint8]]
    dark: BoolArray
    contrast: Float32Array


def matched_heights(true: TrueView, noise: HeightNoise, seed: int) -> Float32Array:
    """(rows, cols) float32 heights as matching would leave them; NaN where it finds nothing."""
    known = np.isfinite(true.height)
    low = float(np.nanmin(true.height)) if known.any() else 0.0
    exact = np.where(known, true.height - low, 0.0).astype(np.float32)
    leaves = (true.kind == LEAVES).astype(np.uint8)
    height = _closed_crowns(exact, leaves.astype(bool))
    height, hole = _gaps_bridged(height, true.grid, noise, seed)
    height, moved = _widened(height, true.grid, noise, seed)
    green = np.where(moved, cv2.dilate(leaves, np.ones((5, 5), np.uint8)), leaves).astype(bool)
    kind = np.where(green, LEAVES, np.where(true.kind == LEAVES, FLAT, true.kind))
    height = height + _errors(kind, true.grid, noise, seed)
    hole |= green & (_chance(true.grid, seed + 5, 2.5) < noise.leaf_missing)
    bland = true.dark & (true.contrast < noise.bland)
    hole |= bland & (_chance(true.grid, seed + 6, 3.0) < noise.dark_missing)
    return np.where(known & ~hole, height + np.float32(low), np.float32(np.nan)).astype(np.float32)


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


def _widened(height: Float32Array, grid: Grid, noise: HeightNoise, seed: int) -> tuple[Float32Array, BoolArray]:
    """Heights whose steps stand a random part of a few cells too far out, and which cells changed."""
    reach = noise.widened_cells * _chance(grid, seed + 1, PATCH_CELLS)
    out = height.copy()
    for cells in range(1, int(np.ceil(noise.widened_cells)) + 1):
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * cells + 1, 2 * cells + 1))
        wide = cv2.dilate(height, disc)
        # a part of a cell: so many of the cells, in patches finer than those of the reach
        chosen = reach > cells - 1 + _chance(grid, seed + 10 + cells, 1.0)
        out = np.where(chosen & (wide - height > np.float32(STEP_M + 1.5 * cells * grid.cell)), wide, out)
    return out, out != height


def _errors(kind: np.ndarray, grid: Grid, noise: HeightNoise, seed: int) -> Float32Array:
    """(rows, cols) errors of the heights, metres."""
    shape = smooth_noise(grid, seed + 4, noise.smooth_cells)
    scale = np.exp(HEAVY * smooth_noise(grid, seed + 7, PATCH_CELLS))
    # an error along the view shows across an upright wall by the sine of the tilt: 45 degrees
    amount = np.array([noise.level_gsd * grid.cell, noise.facade_gsd * grid.cell * np.sqrt(2.0), noise.leaf_m])
    return np.asarray(shape * scale * amount[kind], np.float32)


def _chance(grid: Grid, seed: int, sigma_cells: float) -> Float32Array:
    """(rows, cols) numbers between 0 and 1, evenly distributed, the same over patches."""
    return np.asarray(ndtr(smooth_noise(grid, seed, sigma_cells)), np.float32)
