"""Medians of what is known: of rows, and of blocks of levels."""

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
