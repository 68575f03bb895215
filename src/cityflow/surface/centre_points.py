"""The points around a cell's centre, collected for compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.surface.fuse_cells import CellPoints

MOST_POINTS = 4096
"""Points that one cell looks at; a high wall seen by many views may offer more, and more would tell nothing new."""


class Buffer(NamedTuple):
    """Points around a centre, (M,) each: row, height, weight, place from the centre in cells, and weight in the choice of a surface (`weigh_in`)."""

    at: IntArray
    height: FloatArray
    weight: FloatArray
    east: FloatArray
    south: FloatArray
    say: FloatArray


class Summary(NamedTuple):
    """Of points around a centre: means with their weights of the expected standard deviation and of the height, and the height from the lowest to the
    highest; metres."""

    sigma: float
    height: float
    thickness: float


@njit(cache=True, nogil=True)
def empty_buffer() -> Buffer:
    """Room for as many points as one cell looks at, and for one that is looked at and left."""
    most = MOST_POINTS + 1
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
    """Points within `radius` of a centre into `buffer`, but for their say; their number.

    A point is written in any case and counted where it is near: whether it is cannot be foreseen, and a branch would cost more than the point.
    """
    shape, start, u, v, z, quality = cells.shape, cells.start, cells.u, cells.v, cells.z, cells.quality
    at, height, weight, east, south, _ = buffer
    n, reach = 0, int(np.ceil(radius - 0.5))
    inverse = 1.0 / (radius * radius)
    for i in range(max(r - reach, 0), min(r + reach + 1, shape[0])):
        for j in range(max(c - reach, 0), min(c + reach + 1, shape[1])):
            k = i * shape[1] + j
            for p in range(start[k], start[k + 1]):
                x, y = u[p] + (j - c), v[p] + (i - r)
                d = (x * x + y * y) * inverse
                at[n], height[n], weight[n] = p, z[p], (1 - d) * (1 - d) * quality[p]
                east[n], south[n] = x, y
                n += (d < 1) & (n < MOST_POINTS)
    return n


@njit(cache=True, nogil=True)
def apart_from(buffer: Buffer, n: int, refused: float, step: float) -> int:
    """Of the first `n` entries those `step` metres or more from a height, moved to the front; their number."""
    at, height, weight, east, south, _ = buffer
    kept = 0
    for i in range(n):
        if abs(height[i] - refused) >= step:
            at[kept], height[kept], weight[kept] = at[i], height[i], weight[i]
            east[kept], south[kept] = east[i], south[i]
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def summary(buffer: Buffer, n: int, sigma: Float32Array) -> Summary:
    """Of the first `n` entries, at least one; `sigma` is that of all points."""
    at, height, weight = buffer.at, buffer.height, buffer.weight
    base = height[0]
    total, rough, mean, low, high = 0.0, 0.0, 0.0, base, base
    for i in range(n):
        w, h = weight[i], height[i]
        total, rough, mean = total + w, rough + w * sigma[at[i]], mean + w * (h - base)
        low, high = min(low, h), max(high, h)
    total = max(total, 1e-12)
    return Summary(rough / total, base + mean / total, high - low)


@njit(cache=True, nogil=True)
def weigh_in(buffer: Buffer, n: int, trust: Float32Array, radius: float) -> None:
    """The say of the first `n` entries, gathered within `radius`: their weight where precision does not count."""
    at, east, south, say = buffer.at, buffer.east, buffer.south, buffer.say
    inverse = 1.0 / (radius * radius)
    for i in range(n):
        d = (east[i] * east[i] + south[i] * south[i]) * inverse
        say[i] = (1 - d) * (1 - d) * trust[at[i]]


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
