"""Points of level surfaces under something higher: the ground of an arcade or a passage, the floor of a loggia.

A surface has one height a place, so these are in none. Slanting views see them, as far under as tilt and height allow.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.depth_map import ImagePoints

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
    usable = np.isfinite(points.xyz).all(axis=1) & (points.views >= LEAST_VIEWS)
    band = np.where(usable, np.floor(points.xyz[:, 1] / CELL_M) // BAND_CELLS, np.nan)
    if not usable.any():
        return np.empty((0, 3))
    found = []
    for number in range(int(np.nanmin(band)), int(np.nanmax(band)) + 1):
        south, north = (n * BAND_CELLS * CELL_M for n in (number, number + 1))
        near = usable & (points.xyz[:, 1] >= south - CELL_M) & (points.xyz[:, 1] < north + CELL_M)
        part = _covered_of(points.xyz[near])
        found.append(part[(part[:, 1] >= south) & (part[:, 1] < north)])
    return np.concatenate(found)


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
    # heights ascend within a place, so counts between two heights are differences of positions in one sorted key
    span = float(np.ceil(z.max() - z.min())) + 4 * RISE_M
    key = cells * span + (z - z.min() + RISE_M)
    near, around = np.zeros(len(chosen), np.int64), np.zeros(len(chosen), np.int64)
    for step in (-width - 1, -width, -width + 1, -1, 0, 1, width - 1, width, width + 1):
        middle = key[chosen] + step * span
        for count, by in ((near, LEVEL_M), (around, RISE_M)):
            count += np.searchsorted(key, middle + by) - np.searchsorted(key, middle - by)
    return np.asarray((near >= LEAST_LEVEL) & (near >= LEAST_SHARE * around))


def _one_each(xyz: FloatArray, cells: IntArray) -> FloatArray:
    """The middle point of each place and layer of height."""
    if not len(xyz):
        return np.empty((0, 3))
    layer = np.floor(xyz[:, 2] / HEADROOM_M).astype(np.int64)
    first = np.flatnonzero(np.r_[True, (np.diff(cells) != 0) | (np.diff(layer) != 0)])
    last = np.r_[first[1:], len(xyz)]
    return np.asarray(xyz[(first + last - 1) // 2])
