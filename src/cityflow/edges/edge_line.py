"""A straight edge of a roof in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray

LEAST_LENGTH_M = 0.8
"""Shorter edges could not be told from others; set by hand."""


@dataclass(frozen=True, slots=True)
class EdgeLine:
    """The upper edge of a wall between two parts of a roof.

    Attributes
    ----------
    start, along, outward : (2,) world metres, and unit vectors; the lower part is outside, on the right of `along`
    length : metres
    height, slope : of the upper part's plane in the middle of the edge, metres, and (2,) its rise along and outwards
    drop : metres down to the lower part there
    """

    start: FloatArray
    along: FloatArray
    outward: FloatArray
    length: float
    height: float
    slope: FloatArray
    drop: float

    def places(self, along: FloatArray, off: FloatArray) -> FloatArray:
        """(S, T, 3) world places on the upper plane, extended: so far along the edge, and so far outside of it."""
        s, t = along[:, None], off[None, :]
        xy = self.start + s[..., None] * self.along + t[..., None] * self.outward
        z = self.height + self.slope[0] * (s - self.length / 2) + self.slope[1] * t
        return np.concatenate([xy, z[..., None]], axis=-1)
