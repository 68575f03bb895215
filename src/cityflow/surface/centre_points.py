"""The points around a cell's centre, collected for compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.surface.fuse_cells import CellPoints

MOST_POINTS = 4096
"""Points that one cell looks at; a high wall seen by many views may offer more, and more would tell nothing new."""
MOST_RANKED = 96
"""More points are sorted, fewer are ranked; no result depends on it."""


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
def columns_of(cells: CellPoints) -> NDArray[np.int32]:
    """(N,) column of each point's cell."""
    columns = np.empty(len(cells.z), np.int32)
    for k in range(len(cells.start) - 1):
        for p in range(cells.start[k], cells.start[k + 1]):
            columns[p] = k % cells.shape[1]
    return columns


@njit(cache=True, nogil=True)
def gather(
    r: int, c: int, cells: CellPoints, column: NDArray[np.int32], radius: float, buffer: Buffer
) -> tuple[int, Summary]:
    """Points within `radius` of a centre into `buffer`, but for their say; their number, and what `summary` says of them.

    A point is written in any case and counted where it is near: whether it is cannot be foreseen, and a branch would cost more than the point. Nor can be
    how many points a cell has, so those of cells side by side are one row.
    """
    shape, start, u, v, z, quality = cells.shape, cells.start, cells.u, cells.v, cells.z, cells.quality
    at, height, weight, east, south, _ = buffer
    n, reach = 0, int(np.ceil(radius - 0.5))
    inverse = 1.0 / (radius * radius)
    base, total, rough, mean, low, high = 0.0, 0.0, 0.0, 0.0, np.inf, -np.inf
    left, right = max(c - reach, 0), min(c + reach + 1, shape[1])
    for i in range(max(r - reach, 0), min(r + reach + 1, shape[0])):
        for p in range(start[i * shape[1] + left], start[i * shape[1] + right]):
            x, y, h = u[p] + (column[p] - c), v[p] + (i - r), z[p]
            d = (x * x + y * y) * inverse
            w = (1 - d) * (1 - d) * quality[p]
            at[n], height[n], weight[n] = p, h, w
            east[n], south[n] = x, y
            near = (d < 1) & (n < MOST_POINTS)
            base = h if n == 0 else base
            w = w if near else 0.0
            total, rough, mean = total + w, rough + w * cells.sigma[p], mean + w * (h - base)
            low, high = h if near and h < low else low, h if near and h > high else high
            n += near
    total = max(total, 1e-12)
    return n, Summary(rough / total, base + mean / total, high - low)


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
def sorted_by_height(buffer: Buffer, n: int, other: Buffer) -> Buffer:
    """The first `n` entries from the lowest up, but for their say, in one of both buffers: a few go to their ranks in the other one.

    Ranks of a few are counted faster than these are sorted: to count needs no branch.
    """
    if n > MOST_RANKED:
        _sort(buffer, n)
        return buffer
    at, height, weight, east, south, _ = buffer
    for i in range(n):
        h, rank = height[i], 0
        for j in range(i):
            rank += height[j] <= h
        for j in range(i + 1, n):
            rank += height[j] < h
        other.at[rank], other.height[rank], other.weight[rank] = at[i], h, weight[i]
        other.east[rank], other.south[rank] = east[i], south[i]
    return other


@njit(cache=True, nogil=True)
def _sort(buffer: Buffer, n: int) -> None:
    """Shell sort of the first `n` entries, but for their say."""
    at, height, weight, east, south, _ = buffer
    gap = 1
    while gap < n // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, n):
            a, h, w, x, y, j = at[i], height[i], weight[i], east[i], south[i], i
            while j >= gap and height[j - gap] > h:
                k = j - gap
                at[j], height[j], weight[j], east[j], south[j] = at[k], height[k], weight[k], east[k], south[k]
                j -= gap
            at[j], height[j], weight[j], east[j], south[j] = a, h, w, x, y
        gap //= 3
