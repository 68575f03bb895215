"""A raster with coarser copies of itself, each cell the greatest of four: rays leap over what is low."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import Float32Array, IntArray

LOWEST = np.float32(-1e9)
"""Of cells where nothing is."""


def maxima_pyramid(heights: Float32Array) -> tuple[Float32Array, IntArray]:
    """All levels of (rows, cols) heights in one row, the finest first, up to a single cell; (levels, 3) start, rows and columns of each.

    >>> levels, layout = maxima_pyramid(np.array([[1.0, 5.0, 2.0]], np.float32))
    >>> levels.tolist(), layout.tolist()
    ([1.0, 5.0, 2.0, 5.0, 2.0, 5.0], [[0, 1, 3], [3, 1, 2], [5, 1, 1]])
    """
    level, levels, layout, start = heights, [], [], 0
    while True:
        levels.append(level.ravel())
        layout.append((start, *level.shape))
        start += level.size
        if max(level.shape) == 1:
            return np.concatenate(levels), np.array(layout, np.int64)
        rows, cols = level.shape
        even = np.pad(level, ((0, rows % 2), (0, cols % 2)), constant_values=LOWEST)
        level = np.asarray(even.reshape((rows + 1) // 2, 2, (cols + 1) // 2, 2).max(axis=(1, 3)))
