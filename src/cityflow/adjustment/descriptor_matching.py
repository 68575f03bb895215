"""Matches between the points of two images by their descriptors: mutually the best, and clearly better than any other (Lowe 2004)."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.adjustment.features import Features
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters

ROWS_AT_ONCE = 512
"""Points of the first image that are compared at once; bounds memory."""
FAR = 9.0
"""More than any squared distance of two descriptors of unit length."""
SAME_PX = 2.0
"""Points nearer than this are one place, pixels: SIFT describes a place once for each of its main directions; set by hand."""


class MatchingParameters(Parameters):
    """What counts as a match."""

    ratio: float = Field(
        0.8, gt=0.3, le=1, description="largest distance of the best match, as a share of that of the second best"
    )
    distance: float = Field(
        0.75, gt=0.1, le=1.4, description="largest distance of matched descriptors, which have unit length"
    )


def mutual_matches(first: Features, second: Features, parameters: MatchingParameters) -> IntArray:
    """(K, 2) numbers of points of the first and second image that match, each at most once; ascending by the first."""
    if not len(first) or not len(second):
        return np.empty((0, 2), np.int64)
    best_forth = np.full(len(first), -1, np.int64)
    best_back = np.full(len(second), -1, np.int64)
    least_back = np.full(len(second), FAR)
    ours, theirs = unit_descriptors(first), unit_descriptors(second)
    for top in range(0, len(first), ROWS_AT_ONCE):
        rows = slice(top, min(top + ROWS_AT_ONCE, len(first)))
        squared = 2.0 - 2.0 * (ours[rows] @ theirs.T)
        best_forth[rows] = _distinct(squared, second.uv, parameters)
        nearest = squared.argmin(axis=0)
        least = squared[nearest, np.arange(len(second))]
        better = least < least_back
        best_back[better], least_back[better] = nearest[better] + top, least[better]
    chosen = np.flatnonzero(best_forth >= 0)
    chosen = chosen[best_back[best_forth[chosen]] == chosen]
    return np.column_stack([chosen, best_forth[chosen]])


def unit_descriptors(features: Features) -> np.ndarray:
    """(N, 128) float32 descriptors of unit length."""
    values = features.descriptors.astype(np.float32)
    return values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-6)


def _distinct(squared: np.ndarray, uv: FloatArray, parameters: MatchingParameters) -> IntArray:
    """(N,) the best point for each row where it is clearly better than any at another place, else -1."""
    rows = np.arange(len(squared))
    best = squared.argmin(axis=1)
    least = squared[rows, best]
    others = squared.copy()
    others[rows, best] = FAR
    second = others.argmin(axis=1)
    # the same place described twice is no rival
    same = np.linalg.norm(uv[second] - uv[best], axis=1) < SAME_PX
    others[rows[same], second[same]] = FAR
    rival = others.min(axis=1)
    good = (least < parameters.distance**2) & (least < parameters.ratio**2 * rival)
    return np.where(good, best, -1)
