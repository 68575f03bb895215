"""Gaps of a raster in pictures: small ones are filled from their surroundings, large ones stay."""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.viewer.relief import NOTHING

REACH_PX = 4.0
"""Gaps through which no disc of this radius fits are filled."""
LEAST_PX = 150
"""So are those of fewer pixels."""
RADII_PX = (2, 5, 11, 23)
"""Means of the nearest known pixels: of a small window where it has some, else of a larger one."""


def without_specks(values: Float32Array, reach_px: float = REACH_PX, least_px: int = LEAST_PX) -> Float32Array:
    """(bands, rows, cols) values, NaN unknown, with small gaps filled; what is known stays bit for bit. Only to be looked at.

    >>> row = np.full((1, 3, 5), 7.0, np.float32); row[0, 1, 2] = np.nan
    >>> without_specks(row)[0, 1].tolist()
    [7.0, 7.0, 7.0, 7.0, 7.0]
    """
    known = np.isfinite(values[0])
    missing = _closed(known, reach_px, least_px) & ~known
    if not missing.any():
        return values
    filled = values.copy()
    for radius in RADII_PX:
        weight = _mean(known.astype(np.float32), radius)
        here = missing & (weight > 0)
        for band in filled:
            band[here] = (
                _mean(np.where(known, np.nan_to_num(band), 0).astype(np.float32), radius) / np.maximum(weight, 1e-9)
            )[here]
        missing &= ~here
        if not missing.any():
            break
    return filled


def quiet_gaps(pixels: ByteArray, known: BoolArray) -> ByteArray:
    """(rows, cols, 3) pixels whose gaps have one colour, like what is around, that draws no eye."""
    if known.all() or not known.any():
        return pixels
    colour = 0.7 * pixels[known].mean(axis=0) + 0.3 * np.array(NOTHING)
    return np.where(known[..., None], pixels, colour.astype(np.uint8))


def _closed(known: BoolArray, reach_px: float, least_px: int) -> BoolArray:
    """What is known, morphologically closed by a disc, and without gaps of few pixels."""
    border = int(np.ceil(reach_px)) + 1
    wide = np.pad(known, border)
    near = _distance(~wide) <= reach_px
    closed = (_distance(near) > reach_px)[border:-border, border:-border] | known
    gaps, count = ndimage.label(~closed)
    sizes = np.bincount(gaps.reshape(-1), minlength=count + 1)
    return np.asarray(closed | (sizes < least_px)[gaps])


def _distance(inside: BoolArray) -> FloatArray:
    """Pixels from every pixel that is inside to the nearest that is not; 0 outside."""
    if inside.all():
        return np.full(inside.shape, np.inf)
    return np.asarray(cv2.distanceTransform(inside.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE))


def _mean(values: Float32Array, radius: int) -> Float32Array:
    size = 2 * radius + 1
    return np.asarray(cv2.boxFilter(values, -1, (size, size), borderType=cv2.BORDER_CONSTANT), np.float32)
