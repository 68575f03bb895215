"""Names for the arrays that the project passes around.

Shapes are stated in docstrings: (N, 3) is N points of x, y, z; (rows, cols) is a raster with row 0 in the north.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]
IntArray = NDArray[np.int64]
ByteArray = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]


def numbers_of(chosen: BoolArray | IntArray) -> IntArray:
    """(N,) numbers of the chosen rows, of a mask or of such numbers: numpy takes rows by number several times faster than by a mask.

    >>> numbers_of(np.array([True, False, True])).tolist()
    [0, 2]
    """
    return np.flatnonzero(chosen) if chosen.dtype == np.bool_ else np.asarray(chosen, np.int64)
