"""Raster cells that hold a wall: the three rules, and the layer in reserve (Nex et al. 2013 §2.3).

A cell may hold more than one wall: both faces of a thin one, two houses a step apart, a corner. So rules are applied to the points of one side
at a time, and cells are joined to strips only where their normals go on from one to the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.kernels import njit
from cityflow.outlines.from_walls.wall_thinning import Int32Array

BINS = 36
"""Of 10 degrees, for the directions in a cell."""
SIDES = 3
"""A cell at the corner of a bay has no more."""


class CellRules(NamedTuple):
    """What makes a cell a wall's.

    Attributes
    ----------
    cell : edge, metres
    height_range : rule (a), metres between the lowest and the highest point;  reserve_range : the same for the reserve
    least_points : rule (b)
    largest_gap : rule (c), metres: mean distance between points one above the other, as a random height meets it
    alike : cosine of the angle within which normals are of one side
    half : metres of wall to either side of a cell that the rules look at; three cells across
    """

    cell: float
    height_range: float
    reserve_range: float
    least_points: int
    largest_gap: float
    alike: float
    half: float


@dataclass(frozen=True, slots=True)
class WallCells:
    """Cells by side, sorted by row, then column, then number of points.

    Attributes
    ----------
    cell : edge, metres
    row, col : (N,) place in a lattice counted from the world's origin, rows northwards
    normal : (N, 2) float32 unit vectors outwards
    sure : (N,) all three rules hold; the others, the reserve, are too low or not filled evenly
    """

    cell: float
    row: Int32Array
    col: Int32Array
    normal: Float32Array
    sure: BoolArray

    def __len__(self) -> int:
        return len(self.row)


def wall_cells(walls: WallPoints, rules: CellRules) -> WallCells:
    """Cells with a point of a wall.

    The rules are put to the points of one side in a strip along the wall through the cell's own points, as narrow as noise allows: one column
    of cells alone would meet nothing but a window.
    """
    if not len(walls):
        empty = np.empty(0, np.int32)
        return WallCells(rules.cell, empty, empty, np.empty((0, 2), np.float32), np.empty(0, bool))
    index = np.floor(walls.xyz[:, :2] / rules.cell).astype(np.int64)
    rim = math.ceil(rules.half / rules.cell) + 1
    low = index.min(axis=0) - rim
    cols, rows = (int(n) for n in index.max(axis=0) - low + 1 + rim)
    place = (index[:, 1] - low[1]) * cols + index[:, 0] - low[0]
    # ties between normals are decided by height, so the order of points does not matter
    order = np.lexsort((walls.normal[:, 1], walls.normal[:, 0], walls.xyz[:, 2], place))
    start = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=rows * cols))])
    row, col, normal, sure = _cells(
        np.ascontiguousarray(walls.xyz[order]), np.ascontiguousarray(walls.normal[order]), start, cols, rules
    )
    return WallCells(
        rules.cell, (row + low[1]).astype(np.int32), (col + low[0]).astype(np.int32), normal.astype(np.float32), sure
    )


def strips(cells: WallCells, alike: float, reach: int) -> IntArray:
    """(N,) number of the strip that each cell belongs to, by the first of its cells: near cells with like normals are of one.

    Parameters
    ----------
    alike : cosine of the largest angle between the normals of neighbours
    reach : cells so far apart are neighbours still; 1 asks that they touch
    """
    if not len(cells):
        return np.empty(0, np.int64)
    row, col = cells.row - cells.row.min() + reach, cells.col - cells.col.min() + reach
    cols = int(col.max()) + 1 + reach
    place = row.astype(np.int64) * cols + col
    start = np.concatenate([[0], np.cumsum(np.bincount(place, minlength=(int(row.max()) + 1 + reach) * cols))])
    root = _joined(place, start, cols, cells.normal.astype(np.float64), alike, reach)
    return np.unique(root, return_inverse=True)[1].astype(np.int64)


@njit(cache=True, nogil=True)
def _cells(
    xyz: FloatArray,
    normal: Float32Array,
    start: IntArray,
    cols: int,
    rules: CellRules,
) -> tuple[Int32Array, Int32Array, FloatArray, BoolArray]:
    cell, height_range, reserve_range, least_points, largest_gap, alike, half = rules
    rows, reach = (len(start) - 1) // cols, int(np.ceil(half / cell)) + 1
    row, col = np.empty(SIDES * len(xyz), np.int32), np.empty(SIDES * len(xyz), np.int32)
    side, sure = np.empty((SIDES * len(xyz), 2)), np.empty(SIDES * len(xyz), np.bool_)
    found = 0
    for r in range(reach, rows - reach):
        for c in range(reach, cols - reach):
            here = r * cols + c
            if start[here] == start[here + 1]:
                continue
            near = _near(start, here, cols)
            left = np.ones(len(near), np.bool_)
            for _ in range(SIDES):
                if not left.any():
                    break
                nx, ny = _commonest(normal, near, left)
                own, x, y = 0, 0.0, 0.0
                taken = False
                for j in range(len(near)):
                    if left[j] and normal[near[j], 0] * nx + normal[near[j], 1] * ny >= alike:
                        left[j], taken = False, True
                        if start[here] <= near[j] < start[here + 1]:
                            own += 1
                            x += xyz[near[j], 0]
                            y += xyz[near[j], 1]
                if not taken:
                    break
                if own == 0:
                    continue
                heights = _heights(
                    xyz, normal, start, (here, cols, reach), (x / own, y / own, nx, ny), (half, 1.5 * cell, alike)
                )
                if len(heights) < least_points or heights[-1] - heights[0] < reserve_range:
                    continue
                row[found], col[found], side[found, 0], side[found, 1] = r, c, nx, ny
                sure[found] = heights[-1] - heights[0] >= height_range and _gap(heights) <= largest_gap
                found += 1
    return row[:found].copy(), col[:found].copy(), side[:found].copy(), sure[:found].copy()


@njit(cache=True, nogil=True)
def _heights(
    xyz: FloatArray,
    normal: Float32Array,
    start: IntArray,
    where: tuple[int, int, int],
    wall: tuple[float, float, float, float],
    limits: tuple[float, float, float],
) -> FloatArray:
    """Sorted heights of the points of one side up to `half` along the wall and `thick` across from the cell's own points."""
    here, cols, reach = where
    x, y, nx, ny = wall
    half, thick, alike = limits
    count = 0
    for r in range(-reach, reach + 1):
        count += start[here + r * cols + reach + 1] - start[here + r * cols - reach]
    heights = np.empty(count)
    count = 0
    for r in range(-reach, reach + 1):
        for j in range(start[here + r * cols - reach], start[here + r * cols + reach + 1]):
            dx, dy = xyz[j, 0] - x, xyz[j, 1] - y
            near = abs(dx * nx + dy * ny) <= thick and abs(dy * nx - dx * ny) <= half
            if near and normal[j, 0] * nx + normal[j, 1] * ny >= alike:
                heights[count] = xyz[j, 2]
                count += 1
    return np.sort(heights[:count])


@njit(cache=True, nogil=True)
def _near(start: IntArray, here: int, cols: int) -> IntArray:
    count = 0
    for r in range(-1, 2):
        count += start[here + r * cols + 2] - start[here + r * cols - 1]
    near = np.empty(count, np.int64)
    count = 0
    for r in range(-1, 2):
        for j in range(start[here + r * cols - 1], start[here + r * cols + 2]):
            near[count] = j
            count += 1
    return near


@njit(cache=True, nogil=True)
def _commonest(normal: Float32Array, near: IntArray, left: BoolArray) -> tuple[float, float]:
    """Mean of the normals about the fullest direction."""
    counts = np.zeros(BINS)
    for j in range(len(near)):
        if left[j]:
            angle = np.arctan2(normal[near[j], 1], normal[near[j], 0])
            counts[int(np.floor(angle / (2 * np.pi) * BINS)) % BINS] += 1.0
    best, fullest = 0, -1.0
    for k in range(BINS):
        total = counts[k] + 0.5 * (counts[(k + 1) % BINS] + counts[k - 1])
        if total > fullest:
            best, fullest = k, total
    angle = (best + 0.5) * 2 * np.pi / BINS
    ux, uy = np.cos(angle), np.sin(angle)
    x, y = 0.0, 0.0
    for j in range(len(near)):
        if left[j] and normal[near[j], 0] * ux + normal[near[j], 1] * uy >= 0.9:
            x += normal[near[j], 0]
            y += normal[near[j], 1]
    length = np.hypot(x, y)
    if length < 1e-9:
        return ux, uy
    return x / length, y / length


@njit(cache=True, nogil=True)
def _gap(heights: FloatArray) -> float:
    """Mean of the gaps between sorted heights, each weighted by its length: what a random height meets."""
    total = heights[-1] - heights[0]
    square = 0.0
    for j in range(1, len(heights)):
        square += (heights[j] - heights[j - 1]) ** 2
    return square / max(total, 1e-9)


@njit(cache=True, nogil=True)
def _joined(place: IntArray, start: IntArray, cols: int, normal: FloatArray, alike: float, reach: int) -> IntArray:
    """Smallest index of every connected set of cells."""
    parent = np.arange(len(place))
    for v in range(len(place)):
        for r in range(reach + 1):
            begin, end = start[place[v] + r * cols - reach], start[place[v] + r * cols + reach + 1]
            for j in range(begin, end):
                if j > v and normal[j, 0] * normal[v, 0] + normal[j, 1] * normal[v, 1] >= alike:
                    a, b = v, j
                    while parent[a] != a:
                        a = parent[a]
                    while parent[b] != b:
                        b = parent[b]
                    if a < b:
                        parent[b] = a
                    else:
                        parent[a] = b
    for v in range(len(place)):
        a = v
        while parent[a] != a:
            a = parent[a]
        parent[v] = a
    return parent
