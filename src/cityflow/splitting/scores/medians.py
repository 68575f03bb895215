"""Medians of what is known: of rows, and of blocks of levels."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit

BINS = 256


def lower_median(values: FloatArray, known: BoolArray) -> FloatArray:
    """(…,) over the last axis the middle one of what is known, the lower of two; NaN where nothing is."""
    ordered, number = np.sort(np.where(known, values, np.inf), axis=-1), known.sum(axis=-1)
    middle = np.take_along_axis(ordered, np.maximum(number - 1, 0)[..., None] // 2, axis=-1)[..., 0]
    return np.where(number > 0, middle, np.nan)


def middle_of_known(values: FloatArray | Float32Array) -> FloatArray:
    """(N, …) → (…,) medians of what is known, as `np.nanmedian` has them, in a third of its time for few rows."""
    ordered, number = np.sort(values, axis=0), np.isfinite(values).sum(axis=0)[None]
    low, high = (np.take_along_axis(ordered, np.maximum(k, 0), axis=0)[0] for k in ((number - 1) // 2, number // 2))
    return np.where(number[0] > 0, (low + high) / 2, values.dtype.type(np.nan))


@njit(cache=True, nogil=True)
def _median(histogram: np.ndarray, total: int) -> float:
    """With a share of the bin in which the middle falls."""
    half, before = 0.5 * total, 0.0
    for level in range(BINS):
        if before + histogram[level] >= half:
            return level + (half - before) / histogram[level]
        before += histogram[level]
    return float(BINS)


@njit(cache=True, nogil=True)
def medians_beside(image: Float32Array, columns: IntArray, edges: IntArray, share: float) -> FloatArray:
    """(U, Z, C) levels → (N, B, C) medians of the blocks columns n × rows edges[b] … edges[b + 1]; NaN where less than `share` is known.

    Parameters
    ----------
    columns : (N, 2) first of each block, and the one behind its last
    """
    bands, channels = len(edges) - 1, image.shape[2]
    result = np.full((len(columns), bands, channels), np.nan)
    for n in range(len(columns)):
        first, end = columns[n]
        for b in range(bands):
            cells = (end - first) * (edges[b + 1] - edges[b])
            for c in range(channels):
                histogram = np.zeros(BINS, np.int64)
                total = 0
                for k in range(first, end):
                    for z in range(edges[b], edges[b + 1]):
                        value = image[k, z, c]
                        if np.isfinite(value):
                            histogram[min(max(int(value), 0), BINS - 1)] += 1
                            total += 1
                if total > 0 and total >= share * cells:
                    result[n, b, c] = np.float32(_median(histogram, total))
    return result
