"""Colours where there are none: between pixels by inverse distances, beyond the face's edge from the nearest pixel.

Inverse-distance weighting over all known pixels costs as much as there are pairs of pixels. Here the weight 1 / distance**4 is made of smooth bumps that
double in width from one to the next, each a level of a pyramid of sums, so the cost is that of the pixels alone, however large a hole is.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array

POWER = 4
"""Of the distance: at 2 and below, the many pixels far away would count as much as those at the rim of a hole."""
MIDDLE = 128.0
"""Values are taken from here, so that rounding in single precision stays below a grey level where weights are small."""


def interpolated(colours: Float32Array, known: BoolArray) -> Float32Array:
    """(rows, cols, 3) the colours, with pixels that are not known as means of the known ones, weighted by 1 / distance**4.

    Parameters
    ----------
    colours : (rows, cols, 3) float32;  known : (rows, cols) bool, at least one
    """
    if known.all():
        return colours
    sums = np.zeros((*known.shape, 4), np.float32)
    sums[known, :3] = colours[known] - np.float32(MIDDLE)
    sums[known, 3] = 1.0
    levels = [sums]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(cv2.pyrDown(levels[-1], borderType=cv2.BORDER_REPLICATE))
    total = levels.pop()
    while levels:
        finer = levels.pop()
        # a level's means stand for four times as many pixels as the finer one's, at twice the distance
        total = np.asarray(cv2.pyrUp(total, dstsize=(finer.shape[1], finer.shape[0])), np.float32)
        total *= np.float32(4.0 / 2.0**POWER)
        total += finer
    weight = np.maximum(total[..., 3:], np.float32(1e-30))
    filled = np.divide(total[..., :3], weight, out=total[..., :3])
    filled += np.float32(MIDDLE)
    filled[known] = colours[known]
    return np.asarray(filled)


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
