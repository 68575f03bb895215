"""Façades of panels, of panes or of beams: boxes with no wall between them are no windows."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray

JOINT_M, JOINT_PX = 0.3, 3.0
"""What parts panels, at most; in cells where these are coarse."""
LEAST_LATTICE = 0.1
"""Of a façade, that boxes whose sides run on cover, from which it is a lattice; most of its fields are too faint to be boxes."""
LAP_M = 0.2
"""By which neighbours may overlap: sides are found to a cell or so."""
LEAST_BOXES, MOST_TIGHT = 6, 0.4
"""Boxes that say what a façade is of, and share of them that may have close neighbours both beside and above or below."""


def panelled(bounds: FloatArray, least_m: float) -> bool:
    """Whether boxes (N, 4: low and high corner, metres) lie close to one another in both directions: windows may be coupled, but stand storeys apart.

    Parameters
    ----------
    least_m : joint that the picture shows at best
    """
    if len(bounds) < LEAST_BOXES:
        return False
    joint = max(JOINT_M, least_m)
    return bool(np.mean(_close(bounds, 0, joint) & _close(bounds, 1, joint)) >= MOST_TIGHT)


def latticed(bounds: FloatArray, lattice: BoolArray, windows_m2: float, seen_m2: float) -> bool:
    """Whether boxes whose sides run on cover more of a façade than its windows do, and a good part of it: glass, cladding, or beams from end to end."""
    area = (bounds[:, 2:] - bounds[:, :2]).prod(axis=1)
    covered = float(area[lattice].sum())
    return bool(lattice.sum() >= LEAST_BOXES and covered >= LEAST_LATTICE * seen_m2 and covered > windows_m2)


def _close(boxes: FloatArray, axis: int, joint: float) -> BoolArray:
    """(N,) whether another box follows along an axis, on either side, beyond no more than a joint."""
    low, high = boxes[:, axis], boxes[:, axis + 2]
    begin, end = boxes[:, 1 - axis], boxes[:, 3 - axis]
    gap = np.maximum(low[:, None], low[None]) - np.minimum(high[:, None], high[None])
    level = np.minimum(end[:, None], end[None]) - np.maximum(begin[:, None], begin[None])
    near = (gap <= joint) & (gap > -LAP_M) & (level >= 0.6 * np.minimum((end - begin)[:, None], (end - begin)[None]))
    np.fill_diagonal(near, False)
    return np.asarray(near.any(axis=1))
