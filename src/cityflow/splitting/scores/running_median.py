"""Medians of what is known: before and after every station, in one pass with a histogram of levels; of blocks; of rows."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.kernels import njit

BINS = 256


def lower_median(values: FloatArray, known: BoolArray) -> FloatArray:
    """(…,) over the last axis the middle one of what is known, the lower of two; NaN where nothing is."""
    ordered, number = np.sort(np.where(known, values, np.inf), axis=-1), known.sum(axis=-1)
    middle = np.take_along_axis(ordered, np.maximum(number - 1, 0)[..., None] // 2, axis=-1)[..., 0]
    return np.where(number > 0, middle, np.nan)


@njit(cache=True, nogil=True)
def windowed_medians(levels: Float32Array, width: int, least: int) -> Float32Array:
    """(U, Z) levels of 0 to 255 (NaN: unknown) → (U + 1,) median over columns k − width … k − 1, all Z; NaN below `least` values.

    Entry k looks back from the border before column k; what lies ahead of that border is entry k + width.
    """
    columns, rows = levels.shape
    histogram = np.zeros(BINS, np.int64)
    total = 0
    result = np.full(columns + width + 1, np.nan, np.float32)
    for k in range(columns + width + 1):
        if k > 0 and k - 1 < columns:
            total += _count(levels, k - 1, rows, histogram, 1)
        if k - width - 1 >= 0:
            total -= _count(levels, k - width - 1, rows, histogram, -1)
        if total >= least:
            result[k] = _median(histogram, total)
    return result


@njit(cache=True, nogil=True)
def _count(levels: Float32Array, column: int, rows: int, histogram: np.ndarray, sign: int) -> int:
    number = 0
    for z in range(rows):
        value = levels[column, z]
        if np.isfinite(value):
            histogram[min(max(int(value), 0), BINS - 1)] += sign
            number += 1
    return number


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
def block_medians(image: Float32Array, columns: tuple[int, int], edges: np.ndarray, share: float) -> Float32Array:
    """(U, Z, C) levels → (B, C) medians of the blocks columns × rows edges[b] … edges[b + 1]; NaN where less than `share` is known."""
    bands, channels = len(edges) - 1, image.shape[2]
    result = np.full((bands, channels), np.nan, np.float32)
    for b in range(bands):
        cells = (columns[1] - columns[0]) * (edges[b + 1] - edges[b])
        for c in range(channels):
            histogram = np.zeros(BINS, np.int64)
            total = 0
            for k in range(columns[0], columns[1]):
                for z in range(edges[b], edges[b + 1]):
                    value = image[k, z, c]
                    if np.isfinite(value):
                        histogram[min(max(int(value), 0), BINS - 1)] += 1
                        total += 1
            if total > 0 and total >= share * cells:
                result[b, c] = _median(histogram, total)
    return result
