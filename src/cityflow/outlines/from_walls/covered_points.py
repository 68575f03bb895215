"""Points of level surfaces under something higher: the ground of an arcade or a passage, the floor of a loggia.

A surface has one height a place, so these are in none. Slanting views see them, as far under as tilt and height allow.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray, IntArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.kernels import njit

CELL_M = 0.25
"""Places in plan that points are ordered by; set by hand, as all here."""
BAND_CELLS = 64
"""Rows of places that are looked at together: bounds memory, never changes what is found."""
HEADROOM_M = 1.8
"""Something stands at least so high above a covered point."""
TOP_M, LEAST_AT_TOP = 0.4, 3
"""What covers it are at least so many points within so much height."""
LEVEL_M, RISE_M, LEAST_LEVEL, LEAST_SHARE = 0.2, 1.0, 6, 0.7
"""Of the points around a place within `RISE_M` of its height, this share and this many are within `LEVEL_M`: walls are spread."""
LEAST_VIEWS = 2


def find_covered_points(points: ImagePoints) -> FloatArray:
    """(M, 3) float64 world metres, one a place and height: the median of the points there, in the order of places and heights.

    Parameters
    ----------
    points : world metres; places within a cell of their rim are found from a part of the points
    """
    xyz = points.xyz[_near_covers(points.xyz, points.views)]
    if not len(xyz):
        return np.empty((0, 3))
    band, found = np.floor(xyz[:, 1] / CELL_M) // BAND_CELLS, []
    for number in range(int(band.min()), int(band.max()) + 1):
        south, north = (n * BAND_CELLS * CELL_M for n in (number, number + 1))
        part = _covered_of(xyz[(xyz[:, 1] >= south - CELL_M) & (xyz[:, 1] < north + CELL_M)])
        found.append(part[(part[:, 1] >= south) & (part[:, 1] < north)])
    return np.concatenate(found)


def _near_covers(xyz: FloatArray, views: ByteArray) -> IntArray:
    """Numbers of the usable points in places with heights so far apart that one may cover another, and in those beside them."""
    row, col = np.full(len(xyz), -1, np.int64), np.empty(len(xyz), np.int64)
    rows, cols = _places(xyz, views, row, col)
    if not rows:
        return np.empty(0, np.int64)
    low, high = np.full((rows, cols), np.inf), np.full((rows, cols), -np.inf)
    return np.asarray(_in_reach(xyz, row, col, low, high))


@njit(cache=True, nogil=True)
def _places(xyz, views, row, col):  # type: ignore[no-untyped-def]
    """Put the place of each usable point into `row` and `col`, counted so that a rim of one place is left around all; how many rows and columns these are."""
    r_0, c_0, r_1, c_1 = np.int64(2**62), np.int64(2**62), np.int64(-(2**62)), np.int64(-(2**62))
    usable = np.zeros(len(xyz), np.bool_)
    for i in range(len(xyz)):
        usable[i] = (
            views[i] >= LEAST_VIEWS and np.isfinite(xyz[i, 0]) and np.isfinite(xyz[i, 1]) and np.isfinite(xyz[i, 2])
        )
        if usable[i]:
            r, c = np.int64(np.floor(xyz[i, 1] / CELL_M)), np.int64(np.floor(xyz[i, 0] / CELL_M))
            row[i], col[i] = r, c
            r_0, c_0, r_1, c_1 = min(r, r_0), min(c, c_0), max(r, r_1), max(c, c_1)
    if r_1 < r_0:
        return 0, 0
    for i in range(len(xyz)):
        row[i], col[i] = row[i] - r_0 + 1 if usable[i] else -1, col[i] - c_0 + 1
    return r_1 - r_0 + 3, c_1 - c_0 + 3


@njit(cache=True, nogil=True)
def _in_reach(xyz, row, col, low, high):  # type: ignore[no-untyped-def]
    """Numbers of the points in and beside the places with something high over something; `low` and `high` are filled with the heights of each place."""
    for i in range(len(xyz)):
        r, c = row[i], col[i]
        if r >= 0:
            low[r, c], high[r, c] = min(low[r, c], xyz[i, 2]), max(high[r, c], xyz[i, 2])
    near = np.zeros(low.shape, np.bool_)
    for r in range(1, low.shape[0] - 1):
        for c in range(1, low.shape[1] - 1):
            if high[r, c] - low[r, c] > HEADROOM_M:
                near[r - 1 : r + 2, c - 1 : c + 2] = True
    found, n = np.empty(len(xyz), np.int64), 0
    for i in range(len(xyz)):
        if row[i] >= 0 and near[row[i], col[i]]:
            found[n] = i
            n += 1
    return found[:n].copy()


def _covered_of(xyz: FloatArray) -> FloatArray:
    """Those of a band."""
    if not len(xyz):
        return np.empty((0, 3))
    row, col = (np.floor(v / CELL_M).astype(np.int64) for v in (xyz[:, 1], xyz[:, 0]))
    row, col = row - row.min() + 1, col - col.min() + 1
    cells = row * (int(col.max()) + 2) + col
    order = np.lexsort((xyz[:, 2], cells))
    xyz, cells = xyz[order], cells[order]
    level = np.flatnonzero(_is_covered(xyz[:, 2], cells))
    level = level[_is_level(xyz[:, 2], cells, level, int(col.max()) + 2)]
    return _one_each(xyz[level], cells[level])


def _is_covered(z: FloatArray, cells: IntArray) -> BoolArray:
    """Points with enough points together high enough above them; heights ascend in each cell."""
    number = np.arange(len(z))
    last = np.searchsorted(cells, cells, side="right")
    # the highest point of the cell with enough others close below it
    close = np.full(len(z), False)
    close[LEAST_AT_TOP - 1 :] = (cells[LEAST_AT_TOP - 1 :] == cells[: len(z) - LEAST_AT_TOP + 1]) & (
        z[LEAST_AT_TOP - 1 :] - z[: len(z) - LEAST_AT_TOP + 1] <= TOP_M
    )
    highest = np.maximum.accumulate(np.where(close, number, -1))[last - 1]
    known = (highest >= 0) & (cells[highest] == cells)
    return np.asarray(known & (z[highest] - z > HEADROOM_M))


def _is_level(z: FloatArray, cells: IntArray, chosen: IntArray, width: int) -> BoolArray:
    """Whether the points around each chosen one, 3 by 3 places, are level."""
    start = np.searchsorted(cells, np.arange(int(cells.max()) + width + 3))
    near, around = _counts(z, cells, chosen, start, width)
    return np.asarray((near >= LEAST_LEVEL) & (near >= LEAST_SHARE * around))


@njit(cache=True, nogil=True)
def _counts(z, cells, chosen, start, width):  # type: ignore[no-untyped-def]
    """(M,) points in 3 by 3 places around each chosen one that are within `LEVEL_M` of its height, and within `RISE_M`.

    Heights ascend in each place, and so do those of the chosen points of a place: bounds only move up.
    """
    near, around = np.zeros(len(chosen), np.int64), np.zeros(len(chosen), np.int64)
    by = np.array([-RISE_M, -LEVEL_M, LEVEL_M, RISE_M])
    bound = np.empty((9, 4), np.int64)
    for k in range(len(chosen)):
        own, h = cells[chosen[k]], z[chosen[k]]
        is_new = k == 0 or own != cells[chosen[k - 1]]
        for m in range(9):
            place = own + (m // 3 - 1) * width + m % 3 - 1
            for b in range(4):
                j = start[place] if is_new else bound[m, b]
                while j < start[place + 1] and z[j] < h + by[b]:
                    j += 1
                bound[m, b] = j
            around[k] += bound[m, 3] - bound[m, 0]
            near[k] += bound[m, 2] - bound[m, 1]
    return near, around


def _one_each(xyz: FloatArray, cells: IntArray) -> FloatArray:
    """The middle point of each place and layer of height."""
    if not len(xyz):
        return np.empty((0, 3))
    layer = np.floor(xyz[:, 2] / HEADROOM_M).astype(np.int64)
    first = np.flatnonzero(np.r_[True, (np.diff(cells) != 0) | (np.diff(layer) != 0)])
    last = np.r_[first[1:], len(xyz)]
    return np.asarray(xyz[(first + last - 1) // 2])
