"""The block availability map of a page: for each pixel, how far it is free, or how far until the next free one.

After Frommholz et al. 2017, section 5, where the map keeps free segments of scanlines. Here every pixel of a row knows its segment: a
positive entry says how many pixels are free from here on, a negative one how many are taken before the next free one. Whether a
run of a patch fits is one look, and a collision tells at once how far the patch must move; so no list of segments is searched, and no
grid of earlier patches is needed: the map itself, per pixel, is what stands there. The coarse grid that is left is one of free room:
the longest segment that begins in each block of a row, by which blocks without room are leapt over, and for squares of some sizes
the first column of each row at which one would fit. What is taken stays taken, so that column only moves right, and a patch
that holds such a square need not be tried left of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.kernels import njit
from cityflow.texture.placement.pixel_runs import RunArray

MapArray = NDArray[np.int16]

BEYOND = -32767
"""Entry right of the last column: no free pixel follows."""

PAD = 33
"""Entries right of the last column, so that rows of a power of two do not all begin in the same line of the processor's cache."""

BLOCK_BITS = 7
"""Columns of a block, as a power of two; no result depends on it."""

SQUARES = (4, 6, 8, 11, 16, 23, 32, 45, 64, 91, 128)
"""Edges of the squares that are kept track of, pixels."""

NONE = 32767
"""Column of a square that fits nowhere in a row."""


class Availability(NamedTuple):
    """What is free on a page.

    Attributes
    ----------
    free : (rows, width + `PAD`) int16, see above
    blocks : (rows, n) int16, the longest free segment that begins in each block of 128 columns; the last one is a stop
    longest : (rows,) int64, of each whole row
    squares : (len(SQUARES), rows) int16, column before which no such square with its top in this row is free; `NONE` where none is
    stale : of the same shape, bool, where pixels were taken since that column was found
    """

    free: MapArray
    blocks: MapArray
    longest: IntArray
    squares: MapArray
    stale: BoolArray


@njit(cache=True, nogil=True)
def nothing_taken(rows: int, width: int) -> Availability:
    """The map of an empty page."""
    free = np.empty((rows, width + PAD), np.int16)
    blocks = np.zeros((rows, ((width - 1) >> BLOCK_BITS) + 2), np.int16)
    for row in range(rows):
        for col in range(width):
            free[row, col] = width - col
        free[row, width:] = BEYOND
        blocks[row, 0], blocks[row, -1] = width, -BEYOND
    squares = np.zeros((len(SQUARES), rows), np.int16)
    return Availability(free, blocks, np.full(rows, width, np.int64), squares, np.ones(squares.shape, np.bool_))


@njit(cache=True, nogil=True)
def with_rows(page: Availability, rows: int) -> Availability:
    """The same page with more rows."""
    larger = nothing_taken(rows, page.free.shape[1] - PAD)
    larger.free[: len(page.free)] = page.free
    larger.blocks[: len(page.free)] = page.blocks
    larger.longest[: len(page.free)] = page.longest
    for size in range(len(SQUARES)):
        known = len(page.free) - SQUARES[size] + 1  # below, a square reached beyond the last row
        if known > 0:
            larger.squares[size, :known] = page.squares[size, :known]
    return larger


@njit(cache=True, nogil=True)
def first_column(page: Availability, runs: RunArray, row: int, col: int, last: int) -> int:
    """Smallest column from `col` to `last` at which a patch with these runs and its top in `row` meets nothing; -1 where there is none."""
    free, blocks = page.free, page.blocks
    agreed = i = 0
    while agreed < len(runs):
        # rows are indexed, not sliced: a slice costs more than the look
        line, ahead, length = row + runs[i, 0], runs[i, 1], runs[i, 2]
        at = col + ahead
        entry = free[line, at]
        if entry >= length:
            agreed += 1
        else:
            while entry < length:
                at += abs(entry)
                if at - ahead > last:
                    return -1
                block = at >> BLOCK_BITS
                if blocks[line, block] < length:
                    while blocks[line, block] < length:
                        block += 1
                    at = block << BLOCK_BITS
                    if at - ahead > last:
                        return -1
                entry = free[line, at]
            col, agreed = at - ahead, 1
        i = i + 1 if i + 1 < len(runs) else 0
    return col


@njit(cache=True, nogil=True)
def square_column(page: Availability, size: int, row: int) -> int:
    """Column before which no square of `SQUARES[size]` pixels with its top in `row` is free."""
    if page.stale[size, row]:
        page.squares[size, row] = _first_square(page, SQUARES[size], row, page.squares[size, row])
        page.stale[size, row] = False
    return page.squares[size, row]


@njit(cache=True, nogil=True)
def _first_square(page: Availability, edge: int, row: int, col: int) -> int:
    if row + edge > len(page.free):
        return NONE
    free, last = page.free, page.free.shape[1] - PAD - edge
    agreed = i = 0
    while agreed < edge:
        if col > last:
            return NONE
        agreed += 1
        while free[row + i, col] < edge:
            col += abs(free[row + i, col])
            agreed = 1
            if col > last:
                return NONE
        i = i + 1 if i + 1 < edge else 0
    return col


@njit(cache=True, nogil=True)
def occupy(page: Availability, runs: RunArray, row: int, col: int) -> None:
    """Take the pixels of a patch."""
    for size in range(len(SQUARES)):
        page.stale[size, max(row - SQUARES[size] + 1, 0) : row + runs[:, 0].max() + 1] = True
    for i in range(len(runs)):
        at = row + runs[i, 0]
        begin = col + runs[i, 1]
        _take(page.free[at], begin, begin + runs[i, 2])
        page.longest[at] = _look_through(page.free[at], page.blocks[at])


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
def _look_through(entries: MapArray, blocks: MapArray) -> int:
    """Renew the blocks of a row; its longest segment."""
    blocks[:-1] = 0
    longest = at = 0
    while at < len(entries):
        entry = entries[at]
        if entry > 0:
            blocks[at >> BLOCK_BITS] = max(blocks[at >> BLOCK_BITS], entry)
            longest = max(longest, entry)
        at += abs(entry)
    return longest
