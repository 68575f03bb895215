"""Short edges of a rectangular polygon removed with the least change of its area (Gross 2005, §2.4)."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray

CORNER_COST_M2 = 0.5
"""What one corner more must gain in area to be worth it; set by hand on synthetic towns."""


def alternating_offsets(ring: FloatArray) -> FloatArray:
    """(2n,) offsets x, y, x, y, … of the edges of a ring whose sides run along the axes; vertical edge first.

    Parameters
    ----------
    ring : (2n, 2) corners without the repeated last one and without collinear ones
    """
    start = 0 if ring[0, 0] == ring[1, 0] else 1
    turned = np.roll(ring, -start, axis=0)
    axes = np.arange(len(ring)) % 2
    return np.asarray(turned[np.arange(len(ring)), axes])


def corners_of(offsets: FloatArray) -> FloatArray:
    """(2n, 2) corners of the ring whose edges have these alternating offsets (x, y, x, y, …)."""
    following = np.roll(offsets, -1)
    vertical = np.arange(len(offsets)) % 2 == 0
    return np.column_stack([np.where(vertical, offsets, following), np.where(vertical, following, offsets)])


def without_short_edges(offsets: FloatArray, shortest: float) -> FloatArray:
    """Offsets of a ring without edges shorter than `shortest`; never fewer than four edges.

    An edge goes when its two neighbours get a common line: a step becomes straight, a narrow bulge or notch disappears.
    The common line is that of the longer neighbour, so that the rectangle added or taken is the smaller one. The edge
    whose removal changes the area least goes first.
    """
    ring = np.asarray(offsets, np.float64)
    while len(ring) > 4:
        length = np.abs(np.roll(ring, -1) - np.roll(ring, 1))
        if length.min() >= shortest:
            break
        change = length * np.minimum(np.roll(length, 1), np.roll(length, -1))
        ring = _without_edge(ring, int(np.argmin(np.where(length < shortest, change, np.inf))), length)
    return ring


def _without_edge(ring: FloatArray, edge: int, length: FloatArray) -> FloatArray:
    """The two neighbours of the edge become one, on the line of the longer."""
    n = len(ring)
    before, after = (edge - 1) % n, (edge + 1) % n
    common = ring[before] if length[before] >= length[after] else ring[after]
    # Starting behind the edge keeps the alternation; an odd shift swaps x and y and is undone by one more roll.
    rolled = np.roll(ring, -after)
    rolled[0] = common
    kept = rolled[: n - 2]
    return np.asarray(kept if after % 2 == 0 else np.roll(kept, 1))
