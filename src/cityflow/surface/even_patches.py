"""Even patches in the fine surface of images: crowns have none so wide, however green what lies there is."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import label, maximum_filter1d

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, block_reduced
from cityflow.core.kernels import njit

APART_M = 0.375
"""Five by five places so far apart tell whether the surface is even: a window of 1.5 m, in which a crown is bent; set by hand on flights, as is the next."""
EVEN_M = 0.03
"""RMS off the plane through these places, metres: matching leaves less on a roof, and the crown of a tree is bent by more."""
MAJORITY = 0.5
"""Of the fine cells of a working cell."""
AREA_M2 = 3.0
"""Smaller patches are none, m²: as those of LiDAR."""


def even_patches(dsm: FloatArray | Float32Array, cell: float, factor: int) -> BoolArray:
    """(rows / factor, cols / factor) True on even patches.

    A place is even if any window is in which it lies: beside an eave or a ridge the one further in.

    Parameters
    ----------
    dsm : (rows, cols) metres, NaN where nothing was measured
    cell, factor : cell of it, metres, and how many of them make one of the working grid
    """
    step = max(round(APART_M / cell), 1)
    even = _even(np.ascontiguousarray(dsm, np.float32), step).astype(np.uint8)
    for axis in (0, 1):
        even = maximum_filter1d(even, 4 * step + 1, axis, mode="constant")
    count = block_reduced(np.add, even.astype(np.uint32), factor)
    labels, number = label(count >= MAJORITY * factor * factor)
    large = np.bincount(labels.ravel(), minlength=number + 1) * (cell * factor) ** 2 >= AREA_M2
    large[0] = False
    return np.asarray(large[labels])


@njit(cache=True, nogil=True)
def _even(dsm: Float32Array, step: int) -> BoolArray:
    """(rows, cols) True in the middle of 5 x 5 heights, `step` cells apart, that are all known and lie near one plane."""
    rows, cols = dsm.shape
    out = np.zeros((rows, cols), np.bool_)
    reach = 2 * step
    for r in range(reach, rows - reach):
        for c in range(reach, cols - reach):
            middle = np.float64(dsm[r, c])
            total, square, down, right = 0.0, 0.0, 0.0, 0.0
            for i in range(-2, 3):
                for j in range(-2, 3):
                    z = np.float64(dsm[r + i * step, c + j * step]) - middle
                    total += z
                    square += z * z
                    down += i * z
                    right += j * z
            # of 25 places the squares of either index sum up to 50
            rest = square - total * total / 25.0 - down * down / 50.0 - right * right / 50.0
            out[r, c] = rest <= 25.0 * EVEN_M * EVEN_M
    return out
