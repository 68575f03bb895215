"""Colours on the one side of a border against those on the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.splitting.scores.medians import medians_beside

DARK = 10.0
"""Levels below which differences drown in noise."""
LEAST_KNOWN = 0.1
"""Share of a block of one side from which it has a level."""
SHARP_SHARE = (0.35, 0.65)
"""Share of a façade's height at which its colour changes just there: below the first it does not count, above the second wholly."""


@dataclass(frozen=True, slots=True)
class Sides:
    """How far one may look before and after a border: u of the neighbouring borders, metres."""

    left: float
    right: float


def share_of(near: FloatArray, ratio: FloatArray) -> float:
    """How many of some changes, one a line, go the way of the whole: 0 for few, 1 for most."""
    return most_of(float((near @ ratio > 0.5 * float(ratio @ ratio)).mean()))


def most_of(share: float) -> float:
    return float(np.clip((share - SHARP_SHARE[0]) / (SHARP_SHARE[1] - SHARP_SHARE[0]), 0, 1))


def change_across(
    image: Float32Array, at: FloatArray, u: float, sides: Sides, edges: IntArray, reach: tuple[float, float]
) -> FloatArray:
    """(B, C) relative change from before to after a place; NaN where either is not known.

    Parameters
    ----------
    image, at : (U, Z, C) levels, and (U,) where their columns stand, metres
    edges : (B + 1,) of the bands, rows of the image
    reach : how far from the place the sides end and begin, metres
    """
    side, guard = reach
    before = np.searchsorted(at, [max(sides.left + guard, u - side), u - guard])
    after = np.searchsorted(at, [u + guard, min(sides.right - guard, u + side)])
    if before[1] - before[0] < 2 or after[1] - after[0] < 2:
        return np.full((len(edges) - 1, image.shape[2]), np.nan)
    low, high = medians_beside(image, np.stack([before, after]), edges, LEAST_KNOWN)
    return np.asarray((high - low) / (0.5 * (high + low) + DARK))
