"""Which of the boxes that lie upon each other is the window."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.windows.candidates import Candidates
from cityflow.windows.rows import in_column, in_row, overlap

SAME = 0.75
"""Intersection over union of boxes that are the same thing, found at different brightnesses."""
SUPPORT_WEIGHT = 0.15
"""Of company in rows and columns, beside soundness, of 0 to 1."""


def chosen(found: Candidates, bonus: FloatArray, tolerance: float) -> tuple[Candidates, IntArray]:
    """Boxes that do not overlap, the soundest, and of their kind the most frequent first; and how much company each has.

    Parameters
    ----------
    bonus : (N,) what speaks for a box beside its sides
    """
    first = _without_overlap(found.boxes, found.around, found.soundness + bonus, SAME, 1.1)
    found, bonus = found.of(first), bonus[first]
    worth = found.soundness + SUPPORT_WEIGHT * np.minimum(support(found, tolerance), 4) / 4 + bonus
    found = found.of(_without_overlap(found.boxes, found.around, worth, 0.1, 0.25))
    return found, support(found, tolerance)


def support(found: Candidates, tolerance: float) -> IntArray:
    """(N,) how many others of the same look stand in a row or a column with each."""
    same = found.look[:, None] == found.look[None]
    together = in_row(found.boxes, found.boxes, tolerance) | in_column(found.boxes, found.boxes, tolerance)
    return np.asarray((together & same).sum(axis=1), np.int64)


def _without_overlap(boxes: IntArray, own: IntArray, worth: FloatArray, most: float, most_within: float) -> IntArray:
    """Numbers of boxes that stay, the worthiest first, of equal ones the first; `own` is what each keeps free of others."""
    free, kept = np.ones(len(boxes), bool), []
    for k in np.argsort(-worth, kind="stable"):
        if free[k]:
            kept.append(int(k))
            shared, within = overlap(own[k : k + 1], boxes)
            free &= ~((shared[0] > most) | (within[0] > most_within))
    return np.array(sorted(kept), np.int64)
