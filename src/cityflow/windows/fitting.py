"""Openings that a wall can have as holes: within it, and apart from one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray

RIM_M = 0.02
"""Wall between an opening and the edge of the wall, or the next opening, at least; a hole that touches the edge is none; set by hand on drawn façades."""


def fitted(bounds: FloatArray, sure: FloatArray, standing: BoolArray, wall: Polygon) -> tuple[FloatArray, BoolArray]:
    """Bounds (N, 4: s, t of lower left and upper right corner) as holes of a wall, and which of them can be some, (N,) bool.

    Parameters
    ----------
    sure : (N,) confidence; of two that overlap the surer one stays
    standing : (N,) bool; these may be cut off at the wall base
    """
    out = bounds.copy()
    room = wall.buffer(-RIM_M, join_style="mitre")
    if room.is_empty:
        return out, np.zeros(len(out), bool)
    base = float(room.bounds[1])
    out[:, 1] = np.where(standing, np.maximum(out[:, 1], base), out[:, 1])
    boxes = shapely.box(out[:, 0], out[:, 1], out[:, 2], out[:, 3])
    good = shapely.contains(room.buffer(1e-6), boxes) & (out[:, 3] > out[:, 1] + RIM_M)
    return out, good & _apart(out, sure, good)


def _apart(bounds: FloatArray, sure: FloatArray, good: BoolArray) -> BoolArray:
    kept: list[int] = []
    for k in np.argsort(-sure, kind="stable"):
        if good[k] and not _touches(bounds[k], bounds[kept]):
            kept.append(int(k))
    out = np.zeros(len(bounds), bool)
    out[kept] = True
    return out


def _touches(one: FloatArray, others: FloatArray) -> bool:
    low, high = np.maximum(one[:2], others[:, :2]), np.minimum(one[2:], others[:, 2:])
    return bool(((high - low) > -RIM_M).all(axis=1).any())


def bounds_of(rows: Sequence[tuple[float, float, float, float]]) -> FloatArray:
    """(N, 4), also where there are none."""
    return np.array(rows, np.float64).reshape(-1, 4)
