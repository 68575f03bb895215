"""The points around a cell's centre, collected for compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.surface.fuse_cells import CellPoints

MOST_POINTS = 4096
"""Points that one cell looks at; a high wall seen by many views may offer more, and more would tell nothing new."""


class Buffer(NamedTuple):
    """Points around a centre, (M,) each: row, height, weight, place from the centre in cells, and weight in the choice of a surface."""

    at: IntArray
    height: FloatArray
    weight: FloatArray
    east: FloatArray
    south: FloatArray
    say: FloatArray


@njit(cache=True, nogil=True)
def empty_buffer() -> Buffer:
    """Room for as many points as one cell looks at."""
    most = MOST_POINTS
    return Buffer(
        np.empty(most, np.int64), np.empty(most), np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    )


@njit(cache=True, nogil=True)
def any_around(r: int, c: int, cells: CellPoints, radius: float) -> bool:
    """Whether cells hold any point that `gather` could find."""
    reach = int(np.ceil(radius - 0.5))
    low, high = max(c - reach, 0), min(c + reach + 1, cells.shape[1])
    for i in range(max(r - reach, 0), min(r + reach + 1, cells.shape[0])):
        if cells.start[i * cells.shape[1] + low] < cells.start[i * cells.shape[1] + high]:
            return True
    return False


@njit(cache=True, nogil=True)
def gather(r: int, c: int, cells: CellPoints, radius: float, buffer: Buffer) -> int:
    """Points within `radius` of a centre into `buffer` (row, height, weight); their number."""
    shape, start, u, v, z, quality, trust = (
        cells.shape,
        cells.start,
        cells.u,
        cells.v,
        cells.z,
        cells.quality,
        cells.trust,
    )
    at, height, weight, east, south, say = buffer
    n, reach, most = 0, int(np.ceil(radius - 0.5)), len(at)
    inverse = 1.0 / (radius * radius)
    for i in range(max(r - reach, 0), min(r + reach + 1, shape[0])):
        for j in range(max(c - reach, 0), min(c + reach + 1, shape[1])):
            k = i * shape[1] + j
            for p in range(start[k], start[k + 1]):
                x, y = u[p] + (j - c), v[p] + (i - r)
                d = (x * x + y * y) * inverse
                if d < 1 and n < most:
                    at[n], height[n], weight[n] = p, z[p], (1 - d) * (1 - d) * quality[p]
                    say[n] = (1 - d) * (1 - d) * trust[p]
                    east[n], south[n] = x, y
                    n += 1
    return n


@njit(cache=True, nogil=True)
def apart_from(buffer: Buffer, n: int, refused: float, step: float) -> int:
    """Of the first `n` entries those `step` metres or more from a height, moved to the front; their number."""
    at, height, weight, east, south, say = buffer
    kept = 0
    for i in range(n):
        if abs(height[i] - refused) >= step:
            at[kept], height[kept], weight[kept] = at[i], height[i], weight[i]
            east[kept], south[kept], say[kept] = east[i], south[i], say[i]
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def sort_by_height(buffer: Buffer, n: int) -> None:
    """Shell sort of the first `n` entries."""
    at, height, weight, east, south, say = buffer
    gap = 1
    while gap < n // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, n):
            a, h, w, x, y, s, j = at[i], height[i], weight[i], east[i], south[i], say[i], i
            while j >= gap and height[j - gap] > h:
                k = j - gap
                at[j], height[j], weight[j], east[j], south[j] = at[k], height[k], weight[k], east[k], south[k]
                say[j] = say[k]
                j -= gap
            at[j], height[j], weight[j], east[j], south[j], say[j] = a, h, w, x, y, s
        gap //= 3
