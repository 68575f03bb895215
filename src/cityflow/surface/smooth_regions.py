"""Connected cells without a step between them."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit


@njit(cache=True, nogil=True)
def smooth_regions(heights: FloatArray, kind: IntArray, step: float) -> IntArray:
    """(rows, cols) labels 1, 2, … of connected cells (4 neighbours) of one kind without a step; 0 where kind is 0."""
    rows, cols = heights.shape
    labels = np.zeros((rows, cols), np.int64)
    stack = np.empty((rows * cols, 2), np.int64)
    count = 0
    for r in range(rows):
        for c in range(cols):
            if kind[r, c] == 0 or labels[r, c]:
                continue
            count += 1
            labels[r, c] = count
            stack[0, 0], stack[0, 1] = r, c
            n = 1
            while n:
                n -= 1
                i, j = stack[n, 0], stack[n, 1]
                for d in range(4):
                    k, m = i + (d == 0) - (d == 1), j + (d == 2) - (d == 3)
                    if k < 0 or k >= rows or m < 0 or m >= cols or labels[k, m] or kind[k, m] != kind[i, j]:
                        continue
                    if abs(heights[k, m] - heights[i, j]) <= step:
                        labels[k, m] = count
                        stack[n, 0], stack[n, 1] = k, m
                        n += 1
    return labels
