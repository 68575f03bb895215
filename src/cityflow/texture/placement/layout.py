"""One page filled: patches one by one, in a given order, each at its lowest free spot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.texture.placement.availability import MapArray, empty_map, first_column, occupy
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
    rows = min(bounds.first_rows, bounds.last_rows)
    free, longest = empty_map(rows, bounds.width)
    for patch in order:
        turns = runs[starts[TURNS * patch] : starts[TURNS * patch + TURNS]]
        begins = starts[TURNS * patch : TURNS * patch + TURNS + 1] - starts[TURNS * patch]
        of_turn = slice(TURNS * patch, TURNS * patch + TURNS)
        while True:
            spot = _lowest(turns, begins, shapes[of_turn], distinct[of_turn], free, longest)
            if spot[TURN] >= 0 or len(free) >= bounds.last_rows:
                break
            free, longest = _grown(free, longest, min(2 * len(free), bounds.last_rows))
        if spot[TURN] >= 0:
            spots[patch] = spot
            occupy(free, longest, turns[begins[spot[TURN]] : begins[spot[TURN] + 1]], spot[ROW], spot[COL])


@njit(cache=True, nogil=True)
def _lowest(
    turns: RunArray, begins: IntArray, shapes: IntArray, distinct: BoolArray, free: MapArray, longest: IntArray
) -> IntArray:
    """Of all turns' first spots the one whose foot and middle lie lowest."""
    spot = np.full(3, NOWHERE, np.int64)
    best = np.inf
    for turn in range(TURNS):
        if not distinct[turn]:
            continue
        runs = turns[begins[turn] : begins[turn + 1]]
        height, width = shapes[turn]
        reach = 0.5 * (height + _middle(runs))
        last = len(free) - height + 1
        if best < np.inf:
            last = min(last, int(np.ceil(best - reach)))
        row, col = _first_spot(runs, free, longest, last, free.shape[1] - 1 - width)
        if row >= 0 and row + reach < best:
            best = row + reach
            spot[ROW], spot[COL], spot[TURN] = row, col, turn
    return spot


@njit(cache=True, nogil=True)
def _first_spot(runs: RunArray, free: MapArray, longest: IntArray, rows: int, last: int) -> tuple[int, int]:
    """The first free row below `rows`, and in it the first free column up to `last`."""
    if last < 0:
        return NOWHERE, NOWHERE
    for row in range(rows):
        # the longest run comes first: most rows are out of the question at one look
        if longest[row + runs[0, 0]] >= runs[0, 2]:
            col = first_column(free, runs, row, 0, last)
            if col >= 0:
                return row, col
    return NOWHERE, NOWHERE


@njit(cache=True, nogil=True)
def _middle(runs: RunArray) -> float:
    """Mean row of the pixels."""
    moment = pixels = 0
    for i in range(len(runs)):
        moment += runs[i, 0] * runs[i, 2]
        pixels += runs[i, 2]
    return moment / pixels


@njit(cache=True, nogil=True)
def _grown(free: MapArray, longest: IntArray, rows: int) -> tuple[MapArray, IntArray]:
    larger, more = empty_map(rows, free.shape[1] - 1)
    larger[: len(free)] = free
    more[: len(free)] = longest
    return larger, more
