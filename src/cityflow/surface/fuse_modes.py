"""Height at a cell's centre: the band of heights with the greatest weight of points.

Roof and ground, wall and mixed pixels stand in one cell together. A mean is none of them; the fullest window over the heights is one of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.kernels import njit
from cityflow.surface.centre_points import (
    Buffer,
    any_around,
    apart_from,
    columns_of,
    empty_buffer,
    gather,
    sorted_by_height,
    summary,
    weigh_in,
)
from cityflow.surface.fuse_cells import CellPoints


class ModeRule(NamedTuple):
    """How a surface is found among the points around a centre.

    Attributes
    ----------
    radius, wide_radius : points so near have a say, cells; the second where the support of the first is below `least_support`
    band_m, band_sigmas : a surface's thickness in metres, and in expected standard deviations of its points; the greater counts
    lower_share, step_m : a surface so far below the fullest is taken where it has this share of its weight
    """

    radius: float
    wide_radius: float
    band_m: float
    band_sigmas: float
    least_support: float
    lower_share: float
    step_m: float


class Band(NamedTuple):
    """Entries from `first` to before `last` of sorted heights, and their weight."""

    first: int
    last: int
    weight: float


class Modes(NamedTuple):
    """What the points around each cell's centre agree on; all (rows, cols), NaN or 0 where nothing does.

    Attributes
    ----------
    z : float64, mean height of the agreeing points, metres;  u, v : float32, their mean place from the centre, cells
    support : float32, sum of their weights
    sigma : float32, expected standard deviation of the height, metres
    """

    z: FloatArray
    u: Float32Array
    v: Float32Array
    support: Float32Array
    sigma: Float32Array


def modes(points: CellPoints, rule: ModeRule) -> Modes:
    """The mode of each cell."""
    shape = points.shape
    u, v, support, sigma = np.zeros((4, *shape), np.float32)
    found = Modes(np.full(shape, np.nan), u, v, support, sigma)
    _all_modes(points, np.ones(shape, np.bool_), found.z.copy(), rule, found)
    return found


def modes_again(points: CellPoints, rule: ModeRule, found: Modes, asked: BoolArray) -> None:
    """Put the modes of the cells (rows, cols) that are asked into `found`."""
    _clear(found, asked)
    _all_modes(points, asked, np.full(points.shape, np.nan), rule, found)


def modes_instead(points: CellPoints, rule: ModeRule, found: Modes, asked: BoolArray) -> None:
    """As `modes_again`, of only those points that are at least `rule.step_m` metres away from the height found there."""
    refused = np.where(asked, found.z, np.nan)
    _clear(found, asked)
    _all_modes(points, asked, refused, rule, found)


def _clear(found: Modes, where: BoolArray) -> None:
    for raster in found:
        raster[where] = 0
    found.z[where] = np.nan


@njit(cache=True, nogil=True)
def _all_modes(cells: CellPoints, asked: BoolArray, refused: FloatArray, rule: ModeRule, found: Modes) -> None:
    gathered, other, columns = empty_buffer(), empty_buffer(), columns_of(cells)
    for r in range(cells.shape[0]):
        for c in range(cells.shape[1]):
            if not asked[r, c]:
                continue
            if not any_around(r, c, cells, rule.wide_radius):
                found.sigma[r, c] = np.nan
                continue
            for radius in (rule.radius, rule.wide_radius):
                buffer = gathered
                n, found_there = gather(r, c, cells, columns, radius, buffer)
                if not np.isnan(refused[r, c]):
                    n = apart_from(buffer, n, refused[r, c], rule.step_m)
                    found_there = summary(buffer, n, cells.sigma) if n > 0 else found_there
                if n > 0:
                    rough, centre, between = found_there
                    thick = max(rule.band_m, rule.band_sigmas * rough)
                    # where all lie within the band, there is nothing to choose, and nothing to sort
                    if between > thick:
                        buffer = sorted_by_height(buffer, n, other)
                        weigh_in(buffer, n, cells.trust, radius)
                        first, last = lower_one(buffer, fullest(buffer, n, thick), thick, rule)
                        centre = weighted_median(buffer.height, buffer.weight, first, last)
                    _describe((r, c), cells, (centre, thick), n, buffer, found)
                if found.support[r, c] >= rule.least_support:
                    break
            if found.support[r, c] < rule.least_support:
                found.z[r, c], found.sigma[r, c] = np.nan, np.nan


@njit(cache=True, nogil=True)
def fullest(buffer: Buffer, n: int, band: float) -> Band:
    """First and one past last entry of the window of `band` metres that most speaks for, and how much; of equals the highest.

    How exact a point would be, were it right, tells nothing of whether it is right.
    """
    height, weight = buffer.height, buffer.say
    best, first, last = -1.0, 0, 0
    total, low = 0.0, 0
    for high in range(n):
        total += weight[high]
        while height[high] - height[low] > band:
            total -= weight[low]
            low += 1
        if total >= best - 1e-9:
            best, first, last = total, low, high + 1
    return Band(first, last, best)


@njit(cache=True, nogil=True)
def lower_one(buffer: Buffer, chosen: Band, band: float, rule: ModeRule) -> tuple[int, int]:
    """The window chosen, or the fullest of those that end `rule.step_m` metres or more below it, where that has `rule.lower_share` of its weight.

    Dense matching widens what stands in front by a pixel or two and never what lies behind: where both speak, the one behind is right more often
    than its weight says.
    """
    first, last = chosen.first, chosen.last
    height = buffer.height
    below = 0
    while below < first and height[below] < height[first] - rule.step_m:
        below += 1
    if below == 0:
        return first, last
    lower = fullest(buffer, below, band)
    if lower.weight >= rule.lower_share * chosen.weight:
        return lower.first, lower.last
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
    cell: tuple[int, int], cells: CellPoints, surface: tuple[float, float], n: int, buffer: Buffer, found: Modes
) -> None:
    """Means of the points of a surface (its middle height, and its thickness), and their precision."""
    (r, c), (centre, band) = cell, surface
    at, height, weight, east, south, _ = buffer
    sigma, image = cells.sigma, cells.image
    inner, s_z, s_zz, s_u, s_v, s_s = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    seen = np.uint64(0)
    for i in range(n):
        d = height[i] - centre
        if abs(d) > band / 2:
            continue
        p, w = at[i], weight[i]
        s_u, s_v = s_u + w * east[i], s_v + w * south[i]
        inner, s_z, s_zz, s_s = inner + w, s_z + w * d, s_zz + w * d * d, s_s + w * sigma[p]
        seen |= np.uint64(1) << np.uint64(image[p] % 64)
    if inner <= 0:
        return
    mean = s_z / inner
    scatter = np.sqrt(max(s_zz / inner - mean * mean, 0.0))
    found.z[r, c] = centre + mean
    found.u[r, c], found.v[r, c] = s_u / inner, s_v / inner
    found.support[r, c] = inner
    # errors within one depth map go together, so only images count as independent
    found.sigma[r, c] = max(s_s / inner, scatter) / np.sqrt(_bits(seen))


@njit(cache=True, nogil=True)
def _bits(word: np.uint64) -> np.int64:
    """Number of bits that are set, of pairs, then of fours and eights, whose sum the product has in its highest byte."""
    pairs = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    fours = (pairs & np.uint64(0x3333333333333333)) + ((pairs >> np.uint64(2)) & np.uint64(0x3333333333333333))
    eights = (fours + (fours >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((eights * np.uint64(0x0101010101010101)) >> np.uint64(56))
