"""The height at a cell's centre: where most evidence gathers among the points around it.

Roof and ground, wall and mixed pixels stand in one cell together. A mean is none of them; the fullest window over the heights is one of them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.surface.fuse_cells import CellPoints

MOST_POINTS = 4096
"""Points that one cell looks at; a high wall seen by many views may offer more, and more would tell nothing new."""

Columns = tuple[IntArray, Float32Array, Float32Array, FloatArray, Float32Array, Float32Array, IntArray, Float32Array]
Buffer = tuple[IntArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
"""Row of the point, height, weight, place from the centre in cells, and weight in the choice of a surface."""


@dataclass(frozen=True, slots=True)
class Modes:
    """What the points around each cell's centre agree on; all (rows, cols), NaN or 0 where nothing does.

    Attributes
    ----------
    z : float64, mean height of the agreeing points, metres;  u, v : float32, their mean place from the centre, cells
    support : float32, sum of their weights;  share : float32, of the weight of all points around
    sigma : float32, expected standard deviation of the height, metres
    images : uint8, base images among them
    """

    z: FloatArray
    u: Float32Array
    v: Float32Array
    support: Float32Array
    share: Float32Array
    sigma: Float32Array
    images: ByteArray


def modes(
    points: CellPoints,
    shape: tuple[int, int],
    radii: tuple[float, float],
    band: tuple[float, float],
    least_support: float,
    lower: tuple[float, float],
    instead_of: FloatArray | None = None,
) -> Modes:
    """The mode of each cell.

    From the points within the first of `radii` (cells) of its centre; where their support is below `least_support`, within the second. `band` is
    a surface's thickness in metres, and in expected standard deviations of its points; the greater counts. With `instead_of` (rows, cols; metres)
    only cells with a height there are asked, and only of points at least `lower[1]` metres away from it.
    """
    columns = (points.start, points.u, points.v, points.z, points.quality, points.sigma, points.image, points.trust)
    z = np.full(shape, np.nan)
    floats = np.zeros((5, *shape), np.float32)
    images = np.zeros(shape, np.uint8)
    asked = np.ones(shape, np.bool_) if instead_of is None else np.isfinite(instead_of)
    refused = z.copy() if instead_of is None else instead_of
    _all_modes(columns, (asked, refused), radii, band, least_support, lower, z, floats, images)
    u, v, support, share, sigma = floats
    return Modes(z, u, v, support, share, sigma, images)


def instead(found: Modes, other: Modes, where: BoolArray) -> Modes:
    """`found` with the cells of `other` where (rows, cols) says so."""
    return Modes(*(np.where(where, getattr(other, f.name), getattr(found, f.name)) for f in fields(Modes)))


@njit(cache=True, nogil=True)
def _all_modes(
    columns: Columns, cells: tuple[BoolArray, FloatArray], radii: tuple[float, float], band: tuple[float, float], least: float,
    lower: tuple[float, float], z: FloatArray, floats: Float32Array, images: ByteArray,
) -> None:  # fmt: skip
    asked, refused = cells
    shape = asked.shape
    most = MOST_POINTS
    buffer = (
        np.empty(most, np.int64), np.empty(most), np.empty(most), np.empty(most), np.empty(most), np.empty(most),
    )  # fmt: skip
    for r in range(shape[0]):
        for c in range(shape[1]):
            if not asked[r, c]:
                continue
            for radius in radii:
                n = gather(r, c, shape, columns, radius, buffer)
                if not np.isnan(refused[r, c]):
                    n = apart_from(buffer, n, refused[r, c], lower[1])
                if n > 0:
                    thick = max(band[0], band[1] * _mean_sigma(columns[5], buffer, n))
                    if _is_one_surface(buffer, n, thick):
                        centre = _mean_height(buffer, n)
                    else:
                        sort_by_height(buffer, n)
                        first, last = lower_one(buffer, fullest(buffer, n, thick), thick, lower)
                        centre = weighted_median(buffer[1], buffer[2], first, last)
                    _describe(r, c, columns, (centre, thick), n, buffer, z, floats, images)
                if floats[2, r, c] >= least:
                    break
            if floats[2, r, c] < least:
                z[r, c], floats[4, r, c] = np.nan, np.nan


@njit(cache=True, nogil=True)
def _is_one_surface(buffer: Buffer, n: int, band: float) -> bool:
    """Whether all points lie within the band: then there is nothing to choose, and nothing to sort."""
    height = buffer[1]
    low, high = height[0], height[0]
    for i in range(1, n):
        low, high = min(low, height[i]), max(high, height[i])
    return bool(high - low <= band)


@njit(cache=True, nogil=True)
def _mean_height(buffer: Buffer, n: int) -> float:
    height, weight = buffer[1], buffer[2]
    total, mean = 0.0, 0.0
    for i in range(n):
        total, mean = total + weight[i], mean + weight[i] * (height[i] - height[0])
    return height[0] + mean / max(total, 1e-12)


@njit(cache=True, nogil=True)
def _mean_sigma(sigma: Float32Array, buffer: Buffer, n: int) -> float:
    at, weight = buffer[0], buffer[2]
    total, mean = 0.0, 0.0
    for i in range(n):
        total += weight[i]
        mean += weight[i] * sigma[at[i]]
    return mean / max(total, 1e-12)


@njit(cache=True, nogil=True)
def gather(r: int, c: int, shape: tuple[int, int], columns: Columns, radius: float, buffer: Buffer) -> int:
    """Points within `radius` of a centre into `buffer` (row, height, weight); their number."""
    start, u, v, z, quality, _, _, trust = columns
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


@njit(cache=True, nogil=True)
def fullest(buffer: Buffer, n: int, band: float) -> tuple[int, int, float]:
    """First and one past last entry of the window of `band` metres that most speaks for, and how much; of equals the highest.

    How exact a point would be, were it right, tells nothing of whether it is right.
    """
    height, weight = buffer[1], buffer[5]
    best, first, last = -1.0, 0, 0
    total, low = 0.0, 0
    for high in range(n):
        total += weight[high]
        while height[high] - height[low] > band:
            total -= weight[low]
            low += 1
        if total >= best - 1e-9:
            best, first, last = total, low, high + 1
    return first, last, best


@njit(cache=True, nogil=True)
def lower_one(
    buffer: Buffer, chosen: tuple[int, int, float], band: float, lower: tuple[float, float]
) -> tuple[int, int]:
    """The window chosen, or the fullest of those that end `lower[1]` metres or more below it, where that has `lower[0]` of its weight.

    Dense matching widens what stands in front by a pixel or two and never what lies behind: where both speak, the one behind is right more often
    than its weight says.
    """
    first, last, weight = chosen
    height = buffer[1]
    below = 0
    while below < first and height[below] < height[first] - lower[1]:
        below += 1
    if below == 0:
        return first, last
    low, high, found = fullest(buffer, below, band)
    if found >= lower[0] * weight:
        return low, high
    return first, last


@njit(cache=True, nogil=True)
def weighted_median(height: FloatArray, weight: FloatArray, first: int, last: int) -> float:
    """Median of sorted heights, linear between the middles of their weights."""
    total = 0.0
    for i in range(first, last):
        total += weight[i]
    middle, before = 0.0, 0.0
    for i in range(first, last):
        middle_before, before_this = middle, before
        middle, before = before_this + weight[i] / 2, before_this + weight[i]
        if middle >= total / 2:
            if i == first:
                return height[i]
            share = (total / 2 - middle_before) / max(middle - middle_before, 1e-12)
            return height[i - 1] + (height[i] - height[i - 1]) * share
    return height[last - 1]


@njit(cache=True, nogil=True)
def _describe(
    r: int, c: int, columns: Columns, surface: tuple[float, float], n: int, buffer: Buffer,
    z: FloatArray, floats: Float32Array, images: ByteArray,
) -> None:  # fmt: skip
    """Means of the points of a surface (its middle height, and its thickness), and their precision."""
    centre, band = surface
    at, height, weight, east, south, _ = buffer
    sigma, image = columns[5], columns[6]
    total, inner, s_z, s_zz, s_u, s_v, s_s = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    seen = np.uint64(0)
    for i in range(n):
        total += weight[i]
        d = height[i] - centre
        if abs(d) > band / 2:
            continue
        p, w = at[i], weight[i]
        s_u, s_v = s_u + w * east[i], s_v + w * south[i]
        inner, s_z, s_zz, s_s = inner + w, s_z + w * d, s_zz + w * d * d, s_s + w * sigma[p]
        seen |= np.uint64(1) << np.uint64(image[p] % 64)
    if inner <= 0:
        return
    number = 0
    while seen:
        seen &= seen - np.uint64(1)
        number += 1
    mean = s_z / inner
    scatter = np.sqrt(max(s_zz / inner - mean * mean, 0.0))
    z[r, c] = centre + mean
    floats[0, r, c], floats[1, r, c] = s_u / inner, s_v / inner
    floats[2, r, c], floats[3, r, c] = inner, inner / total
    # errors within one depth map go together, so only images count as independent
    floats[4, r, c] = max(s_s / inner, scatter) / np.sqrt(number)
    images[r, c] = number
