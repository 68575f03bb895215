"""The block availability map of a page: for each pixel, how far it is free, or how far until the next free one.

After Frommholz et al. 2017, section 5, where the map keeps free segments of scanlines. Here every pixel of a row knows its segment: a
positive entry says how many pixels are free from here on, a negative one how many are taken before the next free one. Whether a
run of a patch fits is one look, and a collision tells at once how far the patch must move; so no list of segments is searched, and no
grid of earlier patches is needed: the map itself, per pixel, is what stands there.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cityflow.core.arrays import IntArray
from cityflow.texture.placement.pixel_runs import RunArray

MapArray = NDArray[np.int16]

BEYOND = -32767
"""Entry right of the last column: no free pixel follows."""


@njit(cache=True, nogil=True)
def empty_map(rows: int, width: int) -> tuple[MapArray, IntArray]:
    """(rows, width + 1) int16, all free, and (rows,) int64, the longest free segment of each row."""
    free = np.empty((rows, width + 1), np.int16)
    for row in range(rows):
        for col in range(width):
            free[row, col] = width - col
        free[row, width] = BEYOND
    return free, np.full(rows, width, np.int64)


@njit(cache=True, nogil=True)
def first_column(free: MapArray, runs: RunArray, row: int, col: int, last: int) -> int:
    """Smallest column from `col` to `last` at which a patch with these runs and its top in `row` meets nothing; -1 where there is none."""
    agreed = i = 0
    while agreed < len(runs):
        entries = free[row + runs[i, 0]]
        ahead, length = runs[i, 1], runs[i, 2]
        at = col + ahead
        entry = entries[at]
        if entry >= length:
            agreed += 1
        else:
            while entry < length:
                at += abs(entry)
                if at - ahead > last:
                    return -1
                entry = entries[at]
            col, agreed = at - ahead, 1
        i = i + 1 if i + 1 < len(runs) else 0
    return col


@njit(cache=True, nogil=True)
def occupy(free: MapArray, longest: IntArray, runs: RunArray, row: int, col: int) -> None:
    """Take the pixels of a patch."""
    for i in range(len(runs)):
        entries = free[row + runs[i, 0]]
        begin = col + runs[i, 1]
        _take(entries, begin, begin + runs[i, 2])
        longest[row + runs[i, 0]] = _longest(entries)


@njit(cache=True, nogil=True)
def _take(entries: MapArray, begin: int, end: int) -> None:
    at, count = begin - 1, 1
    while at >= 0 and entries[at] > 0:
        entries[at] = count
        at, count = at - 1, count + 1
    blocked = -entries[end] if entries[end] < 0 else 0
    at = end - 1
    while at >= begin or (at >= 0 and entries[at] < 0):
        blocked = min(blocked + 1, -BEYOND)
        entries[at] = -blocked
        at -= 1


@njit(cache=True, nogil=True)
def _longest(entries: MapArray) -> int:
    longest = at = 0
    while at < len(entries):
        if entries[at] > longest:
            longest = entries[at]
        at += abs(entries[at])
    return longest
