"""The part of a tile with known terrain: its edge inside the tile, and its parts of the tile's border.

What is known of a border is a rule of the cells on both sides of it, so two tiles that see the same cells cut the
border at the same places.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Bounds, Grid

_BESIDE_M = 1e-3
"""To either side of a place on a border; rounding."""


def is_known_at(grid: Grid, known: BoolArray, xy: FloatArray) -> BoolArray:
    """(n,) True where a place (n, 2) lies in a known cell or on the edge of one."""
    found = np.zeros(len(xy), bool)
    for d_x, d_y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        found |= known[_cells(grid, xy + np.array([d_x, d_y]) * _BESIDE_M)]
    return found


def rim(grid: Grid, known: BoolArray, bounds: Bounds) -> list[shapely.LineString]:
    """Lines between known and unknown cells inside the tile, straight stretches as one line each."""
    x_0, y_0, x_1, y_1 = bounds
    tolerance = grid.cell / 4
    lines = []
    for row, col, n in _runs(known[:-1] != known[1:]):
        y = grid.y_max - (row + 1) * grid.cell
        if y_0 + tolerance < y < y_1 - tolerance:
            lines.append(((grid.x_min + col * grid.cell, y), (grid.x_min + (col + n) * grid.cell, y)))
    for col, row, n in _runs((known[:, :-1] != known[:, 1:]).T):
        x = grid.x_min + (col + 1) * grid.cell
        if x_0 + tolerance < x < x_1 - tolerance:
            lines.append(((x, grid.y_max - row * grid.cell), (x, grid.y_max - (row + n) * grid.cell)))
    clipped = [shapely.clip_by_rect(shapely.LineString(line), *bounds) for line in lines]
    return [line for line in clipped if line.geom_type == "LineString" and not line.is_empty]


def stretches(grid: Grid, known: BoolArray, start: FloatArray, end: FloatArray) -> list[tuple[float, float]]:
    """Parts of a border line, as distances from `start` in metres, along which a cell beside it is known.

    A stretch ends where either side begins or ceases to be known: there the rim of one of the two tiles arrives.
    """
    length = float(np.hypot(*(end - start)))
    n = max(round(length / grid.cell), 1)
    along = (end - start) / length
    across = np.array([-along[1], along[0]]) * _BESIDE_M
    middle = start + along * ((np.arange(n) + 0.5) * length / n)[:, None]
    sides = np.stack([known[_cells(grid, middle + across)], known[_cells(grid, middle - across)]])
    cuts = np.flatnonzero(np.r_[True, (sides[:, 1:] != sides[:, :-1]).any(axis=0), True])
    return [(a * length / n, b * length / n) for a, b in pairwise(cuts.tolist()) if sides[:, a].any()]


def _cells(grid: Grid, xy: FloatArray) -> tuple[IntArray, IntArray]:
    row, col = grid.indices(xy[:, 0], xy[:, 1])
    return np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)


def _runs(changes: BoolArray) -> list[tuple[int, int, int]]:
    """Line, first place and length of each run of True along the lines of an array."""
    padded = np.pad(changes, ((0, 0), (1, 1))).astype(np.int8)
    line, first = np.nonzero(np.diff(padded, axis=1) == 1)
    _, after = np.nonzero(np.diff(padded, axis=1) == -1)
    return list(zip(line.tolist(), first.tolist(), (after - first).tolist(), strict=True))
