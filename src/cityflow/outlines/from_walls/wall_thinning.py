"""Points on a voxel lattice fixed in the world, one each, so that neither the cut of tiles nor the number of images matters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.kernels import njit

Int32Array = NDArray[np.int32]

FIXED = 1_000_000
"""Sums run in whole micrometres and millionths: whole numbers add up the same in any order."""
LEAST_SIGMA_M, MOST_SIGMA_M = 0.01, 2.0
"""Bounds of a point's standard deviation: no depth is exacter than a centimetre, and unknown ones count as 2 m; set by hand."""


@dataclass(frozen=True, slots=True)
class Voxels:
    """Occupied voxels, sorted by column of the lattice and then by height.

    Attributes
    ----------
    cell : edge of a voxel, metres
    xyz : (N, 3) weighted mean of the points of each, world metres
    towards : (N, 3) float32, mean direction to the images that see it; shorter than 1 where they disagree
    sigma : (N,) float32, root mean square of the points' precision along the ray, metres
    views : (N,) uint8, most partners of any of its points
    row, col, level : (N,) int32, place in the lattice, counted from the world's origin
    """

    cell: float
    xyz: FloatArray
    towards: Float32Array
    sigma: Float32Array
    views: ByteArray
    row: Int32Array
    col: Int32Array
    level: Int32Array

    def __len__(self) -> int:
        return len(self.xyz)

    def take(self, chosen: BoolArray) -> Voxels:
        return Voxels(
            self.cell, self.xyz[chosen], self.towards[chosen], self.sigma[chosen], self.views[chosen],
            self.row[chosen], self.col[chosen], self.level[chosen],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Columns:
    """Where each column of the lattice begins among sorted voxels.

    Attributes
    ----------
    row_0, col_0 : lattice indices of ``start[0, 0]``, which lies `rim` columns outside the occupied ones
    rows, cols : of the table
    start : (rows · cols + 1,) int32; column (r, c) holds voxels ``start[r · cols + c]`` to ``start[r · cols + c + 1]``
    """

    row_0: int
    col_0: int
    rows: int
    cols: int
    start: Int32Array

    @classmethod
    def of(cls, voxels: Voxels, rim: int) -> Columns:
        """The table over some voxels with `rim` empty columns around."""
        row_0, col_0 = int(voxels.row.min()) - rim, int(voxels.col.min()) - rim
        rows, cols = int(voxels.row.max()) - row_0 + 1 + rim, int(voxels.col.max()) - col_0 + 1 + rim
        place = (voxels.row.astype(np.int64) - row_0) * cols + (voxels.col.astype(np.int64) - col_0)
        counts = np.bincount(place, minlength=rows * cols)
        return cls(row_0, col_0, rows, cols, np.concatenate([[0], np.cumsum(counts)]).astype(np.int32))


class Neighbourhoods(NamedTuple):
    """The surroundings of voxels, for compiled code: of each the voxels of a square of columns, as far up and down.

    Attributes
    ----------
    xyz : (N, 3) of the voxels, sorted as `Columns` has them
    row, col : (N,) int32, column of each in the table
    start, cols : of the table
    reach : columns to each side
    radius : metres, in plan and up and down
    """

    xyz: FloatArray
    row: Int32Array
    col: Int32Array
    start: Int32Array
    cols: int
    reach: int
    radius: float

    @classmethod
    def of(cls, voxels: Voxels, columns: Columns, radius: float) -> Neighbourhoods:
        """Of a table with a rim of ``radius / cell`` empty columns."""
        row, col = voxels.row - columns.row_0, voxels.col - columns.col_0
        return cls(voxels.xyz, row, col, columns.start, columns.cols, math.ceil(radius / voxels.cell), radius)


def thinned(points: ImagePoints, cell: float, least_slant: float) -> Voxels:
    """One point per occupied voxel, the mean of its points, weighted by their precision.

    Parameters
    ----------
    points : world metres
    cell : edge of a voxel, metres
    least_slant : points whose ray stands steeper than this (sine of the angle to the plumb line) are left out:
        no upright surface can be seen along it (Nex et al. 2013 §2.2: mixed pixels lie along the ray)
    """
    usable, index = _slanting(points.xyz, points.centres, points.image, least_slant, cell)
    if not len(index):
        empty = np.empty(0, np.int32)
        return Voxels(
            cell, np.empty((0, 3)), np.empty((0, 3), np.float32), np.empty(0, np.float32), np.empty(0, np.uint8),
            empty, empty, empty,
        )  # fmt: skip
    order, first = _by_voxel(index, *(int(f(index[:, k])) for f in (np.min, np.max) for k in (1, 0)))
    xyz, towards, sigma, views = _means(
        points.xyz, points.image, points.sigma, points.views, points.centres, usable[order], first, cell
    )
    col, row, level = (np.ascontiguousarray(v) for v in index[order[first]].T)
    return Voxels(cell, xyz, towards, sigma, views, row, col, level)


@njit(cache=True, nogil=True)
def _slanting(
    xyz: FloatArray, centres: FloatArray, image: IntArray, least: float, cell: float
) -> tuple[IntArray, Int32Array]:
    """Numbers of the points whose ray slants enough, and their place in the lattice: column, row, level."""
    usable, index, n = np.empty(len(xyz), np.int64), np.empty((len(xyz), 3), np.int32), 0
    for i in range(len(xyz)):
        c = centres[image[i]]
        level = np.hypot(c[0] - xyz[i, 0], c[1] - xyz[i, 1])
        if level >= least * np.hypot(level, c[2] - xyz[i, 2]):
            usable[n] = i
            for k in range(3):
                index[n, k] = np.int32(np.floor(xyz[i, k] / cell))
            n += 1
    return usable[:n].copy(), index[:n].copy()


@njit(cache=True, nogil=True)
def _by_voxel(index: Int32Array, row_0: int, col_0: int, row_1: int, col_1: int) -> tuple[IntArray, IntArray]:
    """Order by row, column and level, and where each voxel begins; points are dealt to columns, and those of a column sorted."""
    cols = col_1 - col_0 + 1
    start = np.zeros((row_1 - row_0 + 1) * cols + 1, np.int64)
    for i in range(len(index)):
        start[(index[i, 1] - row_0) * cols + index[i, 0] - col_0 + 1] += 1
    for k in range(len(start) - 1):
        start[k + 1] += start[k]
    order, at = np.empty(len(index), np.int64), start[:-1].copy()
    for i in range(len(index)):
        k = (index[i, 1] - row_0) * cols + index[i, 0] - col_0
        order[at[k]] = i
        at[k] += 1
    first, n = np.empty(len(index), np.int64), 0
    for k in range(len(start) - 1):
        _sort_by_level(order, index, start[k], start[k + 1])
        for j in range(start[k], start[k + 1]):
            if j == start[k] or index[order[j], 2] != index[order[j - 1], 2]:
                first[n] = j
                n += 1
    return order, first[:n].copy()


@njit(cache=True, nogil=True)
def _sort_by_level(order: IntArray, index: Int32Array, low: int, high: int) -> None:
    """Shell sort: a wall's column may hold thousands of points."""
    gap = 1
    while gap < (high - low) // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(low + gap, high):
            p, j = order[i], i
            level = index[p, 2]
            while j >= low + gap and index[order[j - gap], 2] > level:
                order[j] = order[j - gap]
                j -= gap
            order[j] = p
        gap //= 3


@njit(cache=True, nogil=True)
def _means(
    xyz: FloatArray,
    image: IntArray,
    sigma: Float32Array,
    views: ByteArray,
    centres: FloatArray,
    chosen: IntArray,
    first: IntArray,
    cell: float,
) -> tuple[FloatArray, Float32Array, Float32Array, ByteArray]:
    n = len(first)
    mean, towards = np.empty((n, 3)), np.empty((n, 3), np.float32)
    spread, most = np.empty(n, np.float32), np.zeros(n, np.uint8)
    offset, direction = np.empty(3, np.int64), np.empty(3, np.int64)
    corner = np.empty(3)
    for v in range(n):
        end = first[v + 1] if v + 1 < n else len(chosen)
        offset[:], direction[:] = 0, 0
        total, square = 0, 0
        for k in range(3):
            corner[k] = np.floor(xyz[chosen[first[v]], k] / cell) * cell
        for j in range(first[v], end):
            p = chosen[j]
            s = min(max(np.float64(sigma[p]), LEAST_SIGMA_M), MOST_SIGMA_M) if sigma[p] == sigma[p] else MOST_SIGMA_M
            weight = max(int(1.0 / (s * s)), 1)
            x, y, z = (
                centres[image[p], 0] - xyz[p, 0],
                centres[image[p], 1] - xyz[p, 1],
                centres[image[p], 2] - xyz[p, 2],
            )
            length = np.sqrt(x * x + y * y + z * z)
            direction[0] += int(np.rint(x / length * FIXED))
            direction[1] += int(np.rint(y / length * FIXED))
            direction[2] += int(np.rint(z / length * FIXED))
            for k in range(3):
                offset[k] += weight * int(np.rint((xyz[p, k] - corner[k]) * FIXED))
            total += weight
            square += int(np.rint(s * s * FIXED))
            most[v] = max(most[v], views[p])
        count = end - first[v]
        for k in range(3):
            mean[v, k] = corner[k] + offset[k] / (total * FIXED)
            towards[v, k] = direction[k] / (count * FIXED)
        spread[v] = np.sqrt(square / (count * FIXED))
    return mean, towards, spread, most
