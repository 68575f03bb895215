"""Names for the arrays that the project passes around.

Shapes are stated in docstrings: (N, 3) is N points of x, y, z; (rows, cols) is a raster with row 0 in the north.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

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


def block_reduced(function: np.ufunc, values: NDArray[Any], factor: int) -> NDArray[Any]:
    """(rows / factor, cols / factor) what a function of two leaves of each block of `factor` x `factor` values, of which there are whole ones.

    Row by row and then column by column: numpy takes ten times as long for two axes at once.

    >>> block_reduced(np.maximum, np.array([[1, 5, 2, 0], [3, 4, 1, 7]]), 2)
    array([[5, 7]])
    """
    tall = reduce(function, (values[k::factor] for k in range(factor)))
    return np.asarray(reduce(function, (tall[:, k::factor] for k in range(factor))))
