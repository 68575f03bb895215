"""Recognises façades of panels, panes or beams: boxes without wall between them are not windows."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.windows.facade_picture import Picture

JOINT_M, JOINT_PX = 0.3, 3.0
"""Widest joint between panels: metres, and cells where these are coarse; set by hand on drawn façades, as are those below."""
LAP_M = 0.2
"""Most overlap of neighbours: sides are found to about a cell."""
BANDS, LEAST_KNOWN, THROUGH, BAR_SIGMAS = 12, 6, 0.8, 2.0
"""Equal parts of a line, how many of them must show true texture, share of those in which a bar shows, and by how much of what differs from part to part."""
LEAST_BAR = 0.01
"""Difference of the square root of brightness; on a quiet wall anything is more than its scatter."""
BAR_SIDE_M = 0.16
"""Distance at which a bar is compared with its surroundings."""
LEAST_BARS, BAR_EVERY_M = (4, 2), (2.2, 3.8)
"""Bars, upright and level, at least, and farthest apart in the mean."""
LEAST_MULLIONS, MULLION_EVERY_M = 6, (0.7, 1.7)
"""Least number of upright bars that suffice without level ones, and their mean distance."""
LEAST_HIGH_M = 4.0
"""Least height of a façade that upright bars alone can decide: one of a single storey may be all doors."""
LEAST_BOXES, MOST_TIGHT = 6, 0.4
"""Least number of boxes to decide by, and share of them with close neighbours both beside and above or below from which a façade is panelled."""


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


def _close(boxes: FloatArray, axis: int, joint: float) -> BoolArray:
    """(N,) whether another box follows along an axis, on either side, beyond no more than a joint."""
    low, high = boxes[:, axis], boxes[:, axis + 2]
    begin, end = boxes[:, 1 - axis], boxes[:, 3 - axis]
    gap = np.maximum(low[:, None], low[None]) - np.minimum(high[:, None], high[None])
    level = np.minimum(end[:, None], end[None]) - np.maximum(begin[:, None], begin[None])
    near = (gap <= joint) & (gap > -LAP_M) & (level >= 0.6 * np.minimum((end - begin)[:, None], (end - begin)[None]))
    np.fill_diagonal(near, False)
    return np.asarray(near.any(axis=1))


def barred(picture: Picture, empty: bool = False) -> bool:
    """Whether thin bars run over the whole façade, upright and level, closer than storeys and columns of windows are: a curtain of glass, or panels.

    Parameters
    ----------
    empty : the façade has no window of high confidence: then upright bars alone decide, where they are as close as mullions, not as boards
    """
    rows, cols = picture.light.shape
    wide, high = cols * picture.cell, rows * picture.cell
    upright = _through_lines(picture.light, picture)
    if (
        empty
        and high >= LEAST_HIGH_M
        and max(LEAST_MULLIONS, wide / MULLION_EVERY_M[1]) <= upright <= wide / MULLION_EVERY_M[0]
    ):
        return True
    level = _through_lines(np.ascontiguousarray(picture.light.T), picture)
    return upright >= max(LEAST_BARS[0], wide / BAR_EVERY_M[0]) and level >= max(LEAST_BARS[1], high / BAR_EVERY_M[1])


def _through_lines(light: Float32Array, picture: Picture) -> int:
    """Number of columns that are darker or brighter than their surroundings in most bands from top to bottom; reflections may change the sign."""
    seen = picture.seen if light.shape == picture.seen.shape else picture.seen.T
    side = max(round(picture.pixels(BAR_SIDE_M)), 2)
    if light.shape[1] < 6 * side or light.shape[0] < 2 * BANDS:
        return 0
    beside = (np.roll(light, side, axis=1) + np.roll(light, -side, axis=1)) / 2
    off = np.where(seen, light - beside, 0.0)
    bands = np.array([b.sum(axis=0) for b in np.array_split(off, BANDS)])
    count = np.array([b.sum(axis=0) for b in np.array_split(seen, BANDS)])
    mean, known = bands / np.maximum(count, 1), count >= 2
    noise = 1.48 * np.median(np.abs(mean - np.median(mean, axis=0)), axis=1, keepdims=True)
    bars = known & (np.abs(mean) > np.maximum(BAR_SIGMAS * noise, LEAST_BAR))
    through = (known.sum(axis=0) >= LEAST_KNOWN) & (bars.sum(axis=0) >= THROUGH * known.sum(axis=0))
    return _apart(np.flatnonzero(through[side:-side]), picture.pixels(0.5))


def _apart(at: IntArray, least: float) -> int:
    """How many of some columns are at least so far apart."""
    count, last = 0, -np.inf
    for column in at.tolist():
        if column - last >= least:
            count, last = count + 1, column
    return count
