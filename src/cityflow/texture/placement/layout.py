"""One page filled: patches one by one, in a given order, each at its lowest free spot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.texture.placement.availability import PAD, Availability, first_column, nothing_taken, occupy, with_rows
from cityflow.texture.placement.pixel_runs import TURNS, Patches, RunArray

ROW, COL, TURN = 0, 1, 2

NOWHERE = -1


class Bounds(NamedTuple):
    """Columns of a page, the rows that its map begins with, and the rows that it may grow to."""

    width: int
    first_rows: int
    last_rows: int


def filled(patches: Patches, order: IntArray, bounds: Bounds) -> IntArray:
    """(P, 3) int64 row, column, quarter turns of the patches in `order`; `NOWHERE` for others, and for those that find no spot."""
    spots = np.full((len(patches), 3), NOWHERE, np.int64)
    _fill(order, patches.runs, patches.starts, patches.shapes, patches.distinct, bounds, spots)
    return spots


@njit(cache=True, nogil=True)
def _fill(
    order: IntArray,
    runs: RunArray,
    starts: IntArray,
    shapes: IntArray,
    distinct: BoolArray,
    bounds: Bounds,
    spots: IntArray,
) -> None:
    page = nothing_taken(min(bounds.first_rows, bounds.last_rows), bounds.width)
    for patch in order:
        of = slice(TURNS * patch, TURNS * patch + TURNS)
        begins = starts[TURNS * patch : TURNS * patch + TURNS + 1]
        spot = _lowest(runs, begins, shapes[of], distinct[of], page)
        while spot[TURN] < 0 and len(page.free) < bounds.last_rows:
            page = with_rows(page, min(2 * len(page.free), bounds.last_rows))
            spot = _lowest(runs, begins, shapes[of], distinct[of], page)
        if spot[TURN] >= 0:
            spots[patch] = spot
            occupy(page, runs[begins[spot[TURN]] : begins[spot[TURN] + 1]], spot[ROW], spot[COL])


@njit(cache=True, nogil=True)
def _lowest(runs: RunArray, begins: IntArray, shapes: IntArray, distinct: BoolArray, page: Availability) -> IntArray:
    """Of all turns' first spots the one whose foot and middle lie lowest."""
    spot = np.full(3, NOWHERE, np.int64)
    best = np.inf
    for turn in range(TURNS):
        if not distinct[turn]:
            continue
        turned = runs[begins[turn] : begins[turn + 1]]
        height, width = shapes[turn]
        reach = reach_of(turned, height)
        rows = len(page.free) - height + 1
        if best < np.inf:
            rows = min(rows, int(max(best - reach, -2.0)) + 2)
        row, col = first_spot(turned, page, 0, rows, last_column(page, width))
        if row >= 0 and row + reach < best:
            best = row + reach
            spot[ROW], spot[COL], spot[TURN] = row, col, turn
    return spot


@njit(cache=True, nogil=True)
def first_spot(runs: RunArray, page: Availability, first: int, end: int, last: int) -> tuple[int, int]:
    """The first row from `first` and below `end` with a free spot, and in it the first free column up to `last`; `NOWHERE` if none."""
    if last < 0:
        return NOWHERE, NOWHERE
    for row in range(first, end):
        # the longest run comes first: many rows are out of the question at one look
        if page.longest[row + runs[0, 0]] >= runs[0, 2]:
            col = first_column(page, runs, row, 0, last)
            if col >= 0:
                return row, col
    return NOWHERE, NOWHERE


@njit(cache=True, nogil=True)
def last_column(page: Availability, width: int) -> int:
    """The last column that a patch of this width may begin in; negative where the page is narrower."""
    return page.free.shape[1] - PAD - width


@njit(cache=True, nogil=True)
def reach_of(runs: RunArray, height: int) -> float:
    """Half way between the mean row of the pixels and the foot of the patch: how far it reaches down from its top, rows."""
    moment = pixels = 0
    for i in range(len(runs)):
        moment += runs[i, 0] * runs[i, 2]
        pixels += runs[i, 2]
    return 0.5 * (height + moment / pixels)
