"""Storeys from rows of windows; doors from their height relative to the rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.windows.facade_picture import Picture

LEAST_STOREY_M, USUAL_STOREY_M, MOST_STOREY_M = 2.2, 2.9, 4.5
"""Heights of storeys: lowest, usual and highest of houses and shops; set by hand."""
DOOR_M = 1.8
"""Least height of a door; set by hand on drawn façades."""


def storeys_of(bounds: Sequence[tuple[float, float, float, float]], wall_base: float) -> int:
    """Number of storeys from rows of windows, with those between or below that show none; 0 where there are too few.

    Required are two rows, or one of two windows above the ground. Storeys that are only inferred, from the height of rows above the base and above one
    another, are never more than those seen.

    Parameters
    ----------
    bounds : lower left and upper right corner of windows; only the heights count
    wall_base : height of the wall base, metres
    """
    if len(bounds) < 2:
        return 0
    middles = np.sort([(b[1] + b[3]) / 2 for b in bounds])
    rows = [float(np.mean(part)) for part in np.split(middles, np.flatnonzero(np.diff(middles) > 0.5) + 1)]
    levels = [rows[0]]
    for row in rows[1:]:
        if row - levels[-1] >= LEAST_STOREY_M - 0.4:
            levels.append(row)
    gaps = np.diff(levels)
    usual = gaps[gaps <= MOST_STOREY_M]
    pitch = float(np.median(usual)) if len(usual) else USUAL_STOREY_M
    between = int(np.sum(np.maximum(np.rint(gaps / pitch).astype(int) - 1, 0))) if len(gaps) else 0
    inferred = between + max(int((levels[0] - wall_base - 0.7) / pitch), 0)
    least = len(levels) if len(levels) > 1 else 0
    return len(levels) + inferred if inferred <= least else 0


def door_like(boxes: FloatArray, picture: Picture) -> BoolArray:
    """(N,) tall boxes that stand lower than the lowest row of windows, and begin within its height."""
    high, wide = (picture.cell * (boxes[:, b] - boxes[:, a]) for a, b in ((1, 3), (0, 2)))
    tall = (high >= DOOR_M) & (high >= 1.3 * wide)
    out = np.zeros(len(boxes), bool)
    for k in np.flatnonzero(tall):
        others = np.delete(boxes, k, axis=0)
        beside = others[(others[:, 1] < boxes[k, 3]) & (others[:, 3] > boxes[k, 1])]
        lower = bool((others[:, 1] > boxes[k, 3]).any())
        out[k] = len(beside) > 0 and not lower and bool((boxes[k, 3] - np.median(beside[:, 3])) * picture.cell >= 0.4)
    return out
