"""Vertical parallax of a rectified pair: row offset between corresponding pixels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.matching.lattice import PairLattice
from cityflow.matching.resample import resampled

PATCH_PX = 16
"""Edge of a patch whose shift is estimated; set by hand, as are the next two."""
LEAST_PATCHES = 12
"""Fewer good patches correct nothing."""
LEAST_TEXTURE = 12.0
"""Variance of grey values (of 255) below which a patch tells no shift."""


@dataclass(frozen=True, slots=True)
class VerticalParallax:
    """Vertical parallax in pixels of level 0.

    Attributes
    ----------
    median_px : median of its absolute value over the image, before correction;  ninety_px : 90 % of the patches are within this, before correction
    rest_px : median of the absolute rest after correction
    offset : (constant, per x, per y) that corrects it
    patches : number of patches with texture
    """

    median_px: float
    ninety_px: float
    rest_px: float
    offset: tuple[float, float, float]
    patches: int


def vertical_parallax(lattice: PairLattice, level: int) -> VerticalParallax | None:
    """Measure it over the whole image at a coarse level, by one least-squares step per patch; None where too few patches have texture.

    The partner is drawn to the reference image by the disparities found, so only rows are left to differ.
    """
    parts = []
    down, right = lattice.grid(level)
    for i in range(down):
        for j in range(right):
            if lattice.range(level, (i, j)) is not None:
                parts.append(_patches(lattice, level, (i, j)))
    samples = np.concatenate(parts) if parts else np.empty((0, 3))
    if len(samples) < LEAST_PATCHES:
        return None
    offset, rest = _plane(samples)
    shift = samples[:, 2]
    return VerticalParallax(
        float(np.median(np.abs(shift))),
        float(np.percentile(np.abs(shift), 90)),
        float(np.median(np.abs(rest))),
        offset,
        len(samples),
    )


def _patches(lattice: PairLattice, level: int, block: tuple[int, int]) -> FloatArray:
    """(N, 3) of rectified x, y and vertical parallax, pixels of level 0."""
    top, bottom, left, right = lattice.bounds(level, block)
    disparity = lattice.disparity(level, block)
    known = np.isfinite(disparity)
    if not known.any():
        return np.empty((0, 3))
    low, high = int(np.floor(disparity[known].min())) - 2, int(np.ceil(disparity[known].max())) + 3
    shape = (bottom - top, right - left)
    reference, _ = resampled(lattice.images[0], lattice.pair.reference_pixels, (top, left), shape, level)
    wide = (shape[0], shape[1] + high - low)
    partner, _ = resampled(lattice.images[1], lattice.pair.partner_pixels, (top, left - high), wide, level)
    cols, rows = np.meshgrid(np.arange(shape[1], dtype=np.float32), np.arange(shape[0], dtype=np.float32))
    drawn = cv2.remap(
        partner.astype(np.float32), cols - np.nan_to_num(disparity) + np.float32(high), rows, cv2.INTER_LINEAR
    )
    shift, good = _row_shift(reference.astype(np.float32), np.asarray(drawn, np.float32), known)
    at_row, at_col = np.nonzero(good)
    step = float(1 << level)
    return np.column_stack([
        (left + (at_col + 0.5) * PATCH_PX) * step, (top + (at_row + 0.5) * PATCH_PX) * step, shift[good] * step
    ])  # fmt: skip


def _row_shift(reference: Float32Array, drawn: Float32Array, known: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Shift of rows per patch: drawn(row + shift) = reference(row); and which patches have enough texture."""
    smooth = [cv2.GaussianBlur(image, (0, 0), 1.0) for image in (reference, drawn)]
    slope = [np.gradient(image, axis=0) for image in smooth]
    mean = 0.5 * (slope[0] + slope[1])
    inner = cv2.erode(known.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    weight = inner.astype(np.float64)
    sums = [_sums(weight * a) for a in (1.0 + 0 * mean, mean, mean * mean, smooth[0] - smooth[1])]
    product = _sums(weight * mean * (smooth[0] - smooth[1]))
    count = np.maximum(sums[0], 1.0)
    variance = sums[2] - sums[1] ** 2 / count
    shift = (product - sums[1] * sums[3] / count) / np.maximum(variance, 1e-6)
    good = (count > 0.5 * PATCH_PX**2) & (variance / count > LEAST_TEXTURE) & (np.abs(shift) < 1.5)
    return shift, good


def _sums(values: FloatArray) -> FloatArray:
    rows, cols = (n // PATCH_PX for n in values.shape)
    part = values[: rows * PATCH_PX, : cols * PATCH_PX]
    return np.asarray(part.reshape(rows, PATCH_PX, cols, PATCH_PX).sum(axis=(1, 3)))


def _plane(samples: FloatArray) -> tuple[tuple[float, float, float], FloatArray]:
    """Robust fit of shift = a + b·x + c·y, and the rest."""
    x, y, shift = samples.T
    scale = max(float(np.ptp(x)), float(np.ptp(y)), 1.0)
    design = np.column_stack([np.ones_like(x), x / scale, y / scale])
    use = np.abs(shift - np.median(shift)) <= 3 * 1.4826 * np.median(np.abs(shift - np.median(shift))) + 1e-6
    for _ in range(5):
        # a little damping holds the slopes down where patches lie in one corner only
        normal = design[use].T @ design[use] + np.diag([0.0, 0.5, 0.5])
        solution = np.linalg.solve(normal, design[use].T @ shift[use])
        rest = shift - design @ solution
        use = np.abs(rest) <= 3 * 1.4826 * np.median(np.abs(rest)) + 1e-6
    return (float(solution[0]), float(solution[1] / scale), float(solution[2] / scale)), rest
