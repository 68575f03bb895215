"""Selects among overlapping boxes."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.windows.candidates import Candidates
from cityflow.windows.rows import in_column, in_row, overlap

SAME = 0.75
"""Intersection over union from which two boxes are the same object, found at different brightnesses."""
SUPPORT_WEIGHT = 0.15
"""Weight of the support by rows and columns, beside a soundness of 0 to 1; set by hand on drawn façades."""


def chosen(found: Candidates, bonus: FloatArray, tolerance: float) -> tuple[Candidates, IntArray]:
    """Boxes that do not overlap, chosen by soundness and support; and the support of each.

    Parameters
    ----------
    bonus : (N,) added to the soundness of a box
    """
    first = _without_overlap(found.boxes, found.around, found.soundness + bonus, SAME, 1.1)
    found, bonus = found.of(first), bonus[first]
    worth = found.soundness + SUPPORT_WEIGHT * np.minimum(support_of(found, tolerance), 4) / 4 + bonus
    found = found.of(_without_overlap(found.boxes, found.around, worth, 0.1, 0.25))
    return found, support_of(found, tolerance)


def support_of(found: Candidates, tolerance: float) -> IntArray:
    """(N,) number of other boxes of the same channel in the same row or column."""
    same = found.channel[:, None] == found.channel[None]
    together = in_row(found.boxes, found.boxes, tolerance) | in_column(found.boxes, found.boxes, tolerance)
    return np.asarray((together & same).sum(axis=1), np.int64)


def _without_overlap(boxes: IntArray, own: IntArray, worth: FloatArray, most: float, most_within: float) -> IntArray:
    """Numbers of the boxes that stay, taken by descending worth, then by number; `own` is the area that each keeps free of others."""
    free, kept = np.ones(len(boxes), bool), []
    for k in np.argsort(-worth, kind="stable"):
        if free[k]:
            kept.append(int(k))
            left = np.flatnonzero(free)
            shared, within = overlap(own[k : k + 1], boxes[left])
            free[left] = ~((shared[0] > most) | (within[0] > most_within))
    return np.array(sorted(kept), np.int64)
