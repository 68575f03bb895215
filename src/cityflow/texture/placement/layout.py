"""Fills one page: patches one by one, in a given order, each at its lowest free position."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import IntArray
from cityflow.core.kernels import njit
from cityflow.texture.placement.availability import (
    PAD,
    SQUARES,
    Availability,
    first_column,
    nothing_taken,
    occupy,
    square_column,
    with_rows,
)
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
    spots = np.full((len(patches.pixels), 3), NOWHERE, np.int64)
    _fill(patches, order, bounds, spots)
    return spots


@njit(cache=True, nogil=True)
def _fill(patches: Patches, order: IntArray, bounds: Bounds, spots: IntArray) -> None:
    page = nothing_taken(min(bounds.first_rows, bounds.last_rows), bounds.width)
    for patch in order:
        spot = _lowest(patches, patch, page)
        while spot[TURN] < 0 and len(page.free) < bounds.last_rows:
            page = with_rows(page, min(2 * len(page.free), bounds.last_rows))
            spot = _lowest(patches, patch, page)
        if spot[TURN] >= 0:
            spots[patch] = spot
            occupy(page, runs_of(patches, TURNS * patch + spot[TURN]), spot[ROW], spot[COL])


@njit(cache=True, nogil=True)
def _lowest(patches: Patches, patch: int, page: Availability) -> IntArray:
    """Of all turns' first spots the one whose lower edge and middle lie lowest."""
    spot = np.full(3, NOWHERE, np.int64)
    best = np.inf
    for turn in range(TURNS):
        turned = TURNS * patch + turn
        if not patches.distinct[turned]:
            continue
        reach = reach_of(patches, turned)
        end = len(page.free) - patches.shapes[turned, 0] + 1
        if best < np.inf:
            end = min(end, int(max(best - reach, -2.0)) + 2)
        row, col = first_spot(patches, turned, page, 0, end)
        if row >= 0 and row + reach < best:
            best = row + reach
            spot[ROW], spot[COL], spot[TURN] = row, col, turn
    return spot


@njit(cache=True, nogil=True)
def first_spot(patches: Patches, turned: int, page: Availability, first: int, end: int) -> tuple[int, int]:
    """The first row from `first` and below `end` with a free spot, and in it the first free column; `NOWHERE` where there is none."""
    runs = runs_of(patches, turned)
    edge, below, right = patches.squares[turned]
    last = page.free.shape[1] - PAD - patches.shapes[turned, 1]
    size = -1
    while size + 1 < len(SQUARES) and SQUARES[size + 1] <= edge:
        size += 1
    for row in range(first, end if last >= 0 else first):
        # the longest run comes first: many rows are out of the question at one look
        if page.longest[row + runs[0, 0]] < runs[0, 2]:
            continue
        col = max(square_column(page, size, row + below) - right, 0) if size >= 0 else 0
        if col <= last:
            col = first_column(page, runs, row, col, last)
            if col >= 0:
                return row, col
    return NOWHERE, NOWHERE


@njit(cache=True, nogil=True)
def runs_of(patches: Patches, turned: int) -> RunArray:
    """(n, 3) runs of one turned patch."""
    return patches.runs[patches.starts[turned] : patches.starts[turned + 1]]


@njit(cache=True, nogil=True)
def reach_of(patches: Patches, turned: int) -> float:
    """Half way between the mean row of the pixels and the lower edge of the patch: how far it reaches down from its top, rows."""
    runs = runs_of(patches, turned)
    moment = pixels = 0
    for i in range(len(runs)):
        moment += runs[i, 0] * runs[i, 2]
        pixels += runs[i, 2]
    return 0.5 * (patches.shapes[turned, 0] + moment / pixels)
