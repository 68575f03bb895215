"""Conversion between the fine raster and the coarser working grid of terrain and classes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, block_reduced
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.surface.cover import BUILDING, GROUND, VEGETATION

OVERVIEW_M = (0.5, 0.4)
"""Cells of the overview, metres, the better first; set by hand."""


def overview_factor(cell_m: float) -> int:
    """How many fine cells make one of the overview, whose cells have 0.4 to 0.5 m (more only where the fine ones have).

    >>> [overview_factor(c) for c in (0.02, 0.025, 0.04, 0.05, 0.08, 0.1, 0.125, 0.2, 0.25, 0.4, 0.5)]
    [25, 20, 10, 10, 5, 5, 4, 2, 2, 1, 1]
    """
    for wanted in OVERVIEW_M:
        factor = round(wanted / cell_m)
        if factor and abs(factor * cell_m - wanted) < 1e-6 * wanted:
            return factor
    return max(int(OVERVIEW_M[0] / cell_m), 1)


def reduced_median(values: Float32Array, factor: int, least_share: float) -> FloatArray:
    """(rows, cols) upper median of each block of factor x factor cells; NaN where fewer than `least_share` of them are known."""
    out = np.full((values.shape[0] // factor, values.shape[1] // factor), np.nan)
    _block_medians(values, factor, max(least_share * factor * factor, 1.0), np.ones(out.shape, np.bool_), out)
    return out


def median_of_filled(
    filled: Float32Array, before: Float32Array, medians: FloatArray, factor: int, least_share: float
) -> FloatArray:
    """`reduced_median` of a raster of which `medians` are those before its holes were filled."""
    out, asked = medians.copy(), block_reduced(np.logical_or, np.isnan(before), factor)
    _block_medians(filled, factor, max(least_share * factor * factor, 1.0), asked, out)
    return out


@njit(cache=True, nogil=True)
def _block_medians(values: Float32Array, factor: int, least: float, asked: BoolArray, out: FloatArray) -> None:
    near = np.empty(factor * factor, np.float32)
    for r in range(out.shape[0]):
        for c in range(out.shape[1]):
            if not asked[r, c]:
                continue
            n = 0
            for i in range(r * factor, (r + 1) * factor):
                for j in range(c * factor, (c + 1) * factor):
                    near[n] = values[i, j]
                    n += not np.isnan(values[i, j])
            out[r, c] = _upper_median(near[:n]) if n >= least else np.nan


@njit(cache=True, nogil=True)
def _upper_median(values: Float32Array) -> float:
    """That with the rank of half of all: ranks of a few are counted faster than all are sorted."""
    middle = len(values) // 2
    for value in values:
        below, not_above = 0, 0
        for other in values:
            below += other < value
            not_above += other <= value
        if below <= middle < not_above:
            return float(value)
    return np.nan


def refined(values: FloatArray, factor: int) -> Float32Array:
    """(rows · factor, cols · factor) bilinear between the coarse cells' centres; missing ones leave their weight to the others."""
    return np.asarray(_bilinear(values, factor))


@njit(cache=True, nogil=True)
def _bilinear(values: FloatArray, factor: int) -> Float32Array:
    rows, cols = values.shape
    out = np.empty((rows * factor, cols * factor), np.float32)
    for i in range(rows * factor):
        y = min(max((i + 0.5) / factor - 0.5, 0.0), rows - 1.0)
        r = min(int(y), max(rows - 2, 0))
        d_r = y - r
        for j in range(cols * factor):
            x = min(max((j + 0.5) / factor - 0.5, 0.0), cols - 1.0)
            c = min(int(x), max(cols - 2, 0))
            d_c = x - c
            total, weight = 0.0, 0.0
            for k in range(2):
                for m in range(2):
                    v = values[min(r + k, rows - 1), min(c + m, cols - 1)]
                    if not np.isnan(v):
                        w = (d_r if k else 1 - d_r) * (d_c if m else 1 - d_c)
                        total, weight = total + w * v, weight + w
            out[i, j] = total / weight if weight > 1e-9 else np.nan
    return out


def refined_classes(klass: ByteArray, ndsm: Float32Array, factor: int, high_m: float) -> ByteArray:
    """(rows · factor, cols · factor) classes whose borders between high and low follow the fine heights.

    `klass` is coarse, `ndsm` the fine height above the terrain in metres. What is high and lies in a low cell takes the high class most common in
    the 3 x 3 coarse cells around; what is low and lies in a high one becomes ground.
    """
    return np.asarray(_sharpened(klass, ndsm, factor, high_m))


@njit(cache=True, nogil=True)
def _sharpened(klass: ByteArray, ndsm: Float32Array, factor: int, high_m: float) -> ByteArray:
    rows, cols = klass.shape
    out = np.empty(ndsm.shape, np.uint8)
    for r in range(rows):
        for c in range(cols):
            house, green = 0, 0
            for i in range(max(r - 1, 0), min(r + 2, rows)):
                for j in range(max(c - 1, 0), min(c + 2, cols)):
                    house += klass[i, j] == BUILDING
                    green += klass[i, j] == VEGETATION
            own = klass[r, c]
            tall = own
            if own == GROUND and house + green > 0:
                tall = BUILDING if house >= green else VEGETATION
            low = GROUND if own in (BUILDING, VEGETATION) else own
            for i in range(r * factor, (r + 1) * factor):
                for j in range(c * factor, (c + 1) * factor):
                    out[i, j] = tall if ndsm[i, j] > high_m else low
    return out


def surface_colour(
    parts: Sequence[ImagePoints], dsm: Float32Array, grid: Grid, factor: int, reach_m: float
) -> NDArray[np.float32] | None:
    """(rows, cols, bands) mean colour per coarse cell of the points within `reach_m` of the fine surface, in at least one part; NaN without; None for no
    colour."""
    bands = parts[0].colour.shape[1]
    if bands < 3:
        return None
    sums = np.zeros((grid.rows // factor, grid.cols // factor, bands + 1))
    for points in parts:
        _add_colours(points.xyz, points.colour, dsm, (grid.x_min, grid.y_max, grid.cell), factor, reach_m, sums)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(sums[..., -1:] > 0, sums[..., :-1] / sums[..., -1:], np.nan), np.float32)


@njit(cache=True, nogil=True)
def _add_colours(
    xyz: FloatArray, colour: NDArray[np.uint8] | NDArray[np.uint16], dsm: Float32Array, place: tuple[float, float, float], factor: int,
    reach: float, sums: FloatArray,
) -> None:  # fmt: skip
    """Sums of whole numbers, so that the order of the points does not matter."""
    bands = colour.shape[1]
    for i in range(len(xyz)):
        r = int(np.floor((place[1] - xyz[i, 1]) / place[2]))
        c = int(np.floor((xyz[i, 0] - place[0]) / place[2]))
        if r < 0 or c < 0 or r >= dsm.shape[0] or c >= dsm.shape[1] or not abs(xyz[i, 2] - dsm[r, c]) <= reach:
            continue
        row, col = r // factor, c // factor
        if row < sums.shape[0] and col < sums.shape[1]:
            for b in range(bands):
                sums[row, col, b] += colour[i, b]
            sums[row, col, bands] += 1


def thinned_cells(dsm: Float32Array, usable: BoolArray, origin: tuple[int, int], block: int) -> BoolArray:
    """(rows, cols) True in one cell of each block of `block` x `block` cells of the world's lattice: the one with the lower median height.

    `origin` is the lattice row and column of the first cell. Only `usable` cells count; a block with fewer than a third of them gives none.
    """
    return np.asarray(_median_cells(dsm, usable, origin, block))


@njit(cache=True, nogil=True)
def _median_cells(dsm: Float32Array, usable: BoolArray, origin: tuple[int, int], block: int) -> BoolArray:
    rows, cols = dsm.shape
    chosen = np.zeros((rows, cols), np.bool_)
    height, place = np.empty(block * block, np.float32), np.empty(block * block, np.int64)
    for r in range(-(origin[0] % block), rows, block):
        for c in range(-(origin[1] % block), cols, block):
            n = 0
            for i in range(max(r, 0), min(r + block, rows)):
                for j in range(max(c, 0), min(c + block, cols)):
                    if usable[i, j]:
                        m = n
                        while m > 0 and height[m - 1] > dsm[i, j]:
                            height[m], place[m] = height[m - 1], place[m - 1]
                            m -= 1
                        height[m], place[m] = dsm[i, j], i * cols + j
                        n += 1
            if 3 * n >= block * block:
                at = place[(n - 1) // 2]
                chosen[at // cols, at % cols] = True
    return chosen
