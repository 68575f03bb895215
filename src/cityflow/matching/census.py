"""Census of an image: for each pixel, which pixels around it are darker (Zabih and Woodfill 1994)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray
from cityflow.core.kernels import njit
from cityflow.matching.lanes import CENSUS_COLS, CENSUS_ROWS, LANES, census_bits

Census = NDArray[np.uint64]


def census(image: ByteArray) -> Census:
    """(rows, cols + 16) uint64 of a (rows, cols) uint8 image; the last columns are those of pixels beyond its edge."""
    wide = cv2.copyMakeBorder(
        image, CENSUS_ROWS, CENSUS_ROWS + 1, CENSUS_COLS, 2 * LANES + CENSUS_COLS, cv2.BORDER_REPLICATE
    )
    return np.asarray(_census(np.asarray(wide, np.uint8), image.shape[0], image.shape[1] + LANES))


@njit(cache=True, nogil=True)
def _census(wide, rows, cols):  # type: ignore[no-untyped-def]
    stride = wide.shape[1]
    flat = wide.ravel()
    padded = -(-cols // LANES) * LANES
    out = np.empty((rows, padded), np.uint64)
    for i in range(rows):
        row = out[i]
        for j in range(0, padded, LANES):
            census_bits(flat, stride, (i + CENSUS_ROWS) * stride + j + CENSUS_COLS, row, j)
    return out
