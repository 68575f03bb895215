"""Fills missing colours: inside by inverse distances, beyond the face's edge from the nearest pixel.

Inverse-distance weighting over all known pixels costs as much as there are pairs of pixels. Here the weight 1 / distance**4 is made of smooth bumps that
double in width from one to the next, each a level of a pyramid of sums, so the cost is that of the pixels alone, however large a hole is.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array

POWER = 4
"""Of the distance: at 2 and below, the many pixels far away would count as much as those at the rim of a hole; set by hand."""
COARSER = 4.0 / 2.0**POWER
"""A level's means stand for four times as many pixels as the finer one's, at twice the distance."""
BAND_ROWS = 256
"""Rows of the finest level that are worked on at once; even."""
MIDDLE = 128.0
"""Values are taken from here, so that rounding in single precision stays below a grey level where weights are small."""


def interpolated(colours: Float32Array, known: BoolArray) -> Float32Array:
    """(rows, cols, 3) the colours, with pixels that are not known as means of the known ones, weighted by 1 / distance**4.

    Parameters
    ----------
    colours : (rows, cols, 3) float32, changed where not known;  known : (rows, cols) bool, at least one
    """
    if known.all():
        return colours
    coarse = _summed(_down(colours, known)) if max(known.shape) > 1 else _sums(colours, known)
    for first in range(0, len(known), BAND_ROWS):
        band = slice(first, min(first + BAND_ROWS, len(known)))
        total = _up(coarse, known.shape, band)
        total += _sums(colours[band], known[band])
        filled = total[..., :3] / np.maximum(total[..., 3:], np.float32(1e-30)) + np.float32(MIDDLE)
        np.copyto(colours[band], filled, where=~known[band, :, None])
    return colours


def _sums(colours: Float32Array, known: BoolArray) -> Float32Array:
    """(rows, cols, 4) colours that are known, less the middle, and their number."""
    sums = np.zeros((*known.shape, 4), np.float32)
    np.subtract(colours, np.float32(MIDDLE), out=sums[..., :3], where=known[..., None])
    sums[..., 3] = known
    return sums


def _down(colours: Float32Array, known: BoolArray) -> Float32Array:
    """The level above the pixels, made band by band, each with the rows around it that it takes."""
    rows, cols = known.shape
    out = np.empty((-(-rows // 2), -(-cols // 2), 4), np.float32)
    for first in range(0, len(out), BAND_ROWS // 2):
        last = min(first + BAND_ROWS // 2, len(out))
        start = max(first - 2, 0)
        part = slice(2 * start, min(2 * last + 4, rows))
        made = cv2.pyrDown(_sums(colours[part], known[part]), borderType=cv2.BORDER_REPLICATE)
        out[first:last] = made.reshape(-1, *out.shape[1:])[first - start : last - start]
    return out


def _up(coarse: Float32Array, shape: tuple[int, int], band: slice) -> Float32Array:
    """(rows of the band, cols, 4) of the level above the pixels."""
    start, last = max(band.start // 2 - 2, 0), min(-(-band.stop // 2) + 2, len(coarse))
    tall = min(2 * last, shape[0]) - 2 * start
    made = np.asarray(cv2.pyrUp(coarse[start:last], dstsize=(shape[1], tall)), np.float32).reshape(tall, shape[1], 4)
    return made[band.start - 2 * start : band.stop - 2 * start] * np.float32(COARSER)


def _summed(sums: Float32Array) -> Float32Array:
    """All levels above some sums, and these, as one."""
    levels = [sums]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(np.asarray(cv2.pyrDown(levels[-1], borderType=cv2.BORDER_REPLICATE), np.float32))
    total = levels.pop()
    while levels:
        finer = levels.pop()
        total = np.asarray(cv2.pyrUp(total, dstsize=(finer.shape[1], finer.shape[0])), np.float32)
        total *= np.float32(COARSER)
        total += finer
    return total


def nearest(values: NDArray[np.generic], known: BoolArray, wanted: BoolArray) -> NDArray[np.generic]:
    """(rows, cols, …) the values, with those that are wanted and not known taken from the nearest known pixel; at least one is known."""
    asked = wanted & ~known
    if not asked.any():
        return values
    _, labels = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    of_label = np.zeros(int(labels.max()) + 1, np.int32)
    of_label[labels[known]] = np.flatnonzero(known.ravel())
    out = values.copy()
    out[asked] = values.reshape(-1, *values.shape[2:])[of_label[labels[asked]]]
    return out
