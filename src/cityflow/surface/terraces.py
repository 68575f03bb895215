"""Terrain on retaining walls (terraces, hills) among the objects of the morphological opening.

A building is bounded by a step down on all sides. A terrace is held by a way up without a step, or by higher ground
behind it: the shortest way across it ends lower on one side only. As profiles of segments are judged by Sithole and Vosselman
(2005), but for regions, and round after round: what was given back is ground for the terrace above it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.surface.smooth_regions import smooth_regions

MOST_ROUNDS = 50
"""A hill has fewer terraces."""


@dataclass(frozen=True, slots=True)
class TerraceRule:
    """What tells a terrace from a building; lengths in cells, heights in metres.

    Attributes
    ----------
    step : a greater rise from cell to cell is a wall
    even : a smaller one is part of a way up
    way : so many even cells of a region's border lead on to even ground; the way up is two cells wider
    least : fewest cells of a terrace
    bridge, building : a structure with a way up, and any other one, is narrower than this
    """

    step: float
    even: float
    way: int
    least: int
    bridge: float
    building: float


def without_terraces(low: FloatArray, objects: BoolArray, rule: TerraceRule) -> BoolArray:
    """(rows, cols) objects less those regions of them that are terraces.

    Parameters
    ----------
    low : (rows, cols) lowest heights, metres, no gaps
    objects : (rows, cols) what is no ground so far
    """
    objects, even = objects.copy(), even_cells(low, rule.even)
    for _ in range(MOST_ROUNDS):
        regions = smooth_regions(low, (objects & even).astype(np.int64), rule.even)
        count = int(regions.max(initial=0))
        size = np.bincount(regions.ravel(), minlength=count + 1)
        across, held = ways_across(low, objects, regions, (rule.step, rule.building))

        def share(cells: BoolArray, of: IntArray = regions, size: IntArray = size) -> FloatArray:
            return np.bincount(of[cells], minlength=len(size)) / np.maximum(size, 1)

        ways = _ways_up(low, regions, ~objects & even, rule.even, count)
        back = (ways >= rule.way) & (share(across <= rule.bridge) < 0.5) | (share(held) > 0.5)
        back &= size >= rule.least
        back[0] = False
        if not back.any():
            break
        objects &= ~_with_rim(low, back[regions], rule.step)
    return objects


@njit(cache=True, nogil=True)
def even_cells(low: FloatArray, even: float) -> BoolArray:
    """(rows, cols) cells around which no two neighbours of the 3 × 3 differ by more than `even` metres."""
    rows, cols = low.shape
    out = np.ones((rows, cols), np.bool_)
    for r in range(rows):
        for c in range(cols):
            bottom, right = min(r + 2, rows), min(c + 2, cols)
            for i in range(max(r - 1, 0), bottom):
                for j in range(max(c - 1, 0), right):
                    below = i + 1 < bottom and abs(low[i + 1, j] - low[i, j]) > even
                    if below or (j + 1 < right and abs(low[i, j + 1] - low[i, j]) > even):
                        out[r, c] = False
    return out


@njit(cache=True, nogil=True)
def ways_across(
    low: FloatArray, objects: BoolArray, regions: IntArray, limits: tuple[float, float]
) -> tuple[FloatArray, BoolArray]:
    """Of each object cell the shortest of four ways across, and how it ends; `limits` are a step (metres) and the longest way (cells).

    A way passes over its own region and over what is higher. It ends where ground or another region lies lower by a step, or on any other ground.

    Returns
    -------
    length : (rows, cols) cells, where both ends lie lower; infinite elsewhere, and where all ways are longer or leave the raster
    held : (rows, cols) an end is ground that does not lie lower
    """
    step, longest = limits
    rows, cols = low.shape
    length, held = np.full((rows, cols), np.inf), np.zeros((rows, cols), np.bool_)
    for r in range(rows):
        for c in range(cols):
            if not objects[r, c]:
                continue
            best, both = longest, False
            for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
                unit = np.sqrt(down * down + right * right)
                way, lower = 0.0, 0
                for sign in (1, -1):
                    i, j, ended = r, c, False
                    while not ended:
                        i, j, way = i + sign * down, j + sign * right, way + unit
                        if i < 0 or j < 0 or i >= rows or j >= cols or way > best:
                            way = np.inf
                            break
                        other = not objects[i, j] or (regions[i, j] > 0 and regions[i, j] != regions[r, c])
                        ended = not objects[i, j]
                        if other and low[i, j] < low[r, c] - step:
                            lower, ended = lower + 1, True
                if way <= best:
                    best, both = way, lower == 2
                    held[r, c] = not both
            if both:
                length[r, c] = best
    return length, held


def _ways_up(low: FloatArray, regions: IntArray, ground: BoolArray, even: float, count: int) -> IntArray:
    """(count + 1,) pairs of a region's cell and a cell of even ground beside it without a wall between."""
    ways = np.zeros(count + 1, np.int64)
    for a, b in _neighbours():
        met = (regions[a] > 0) & ground[b] & (np.abs(low[b] - low[a]) <= even)
        ways += np.bincount(regions[a][met], minlength=count + 1)
    return ways


def _with_rim(low: FloatArray, cells: BoolArray, step: float) -> BoolArray:
    """Cells, and their neighbours that no wall parts from them."""
    grown = cells.copy()
    for a, b in _neighbours():
        grown[a] |= cells[b] & (np.abs(low[b] - low[a]) <= step)
    return grown


def _neighbours() -> list[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Slices of all cells that have a neighbour on one side, and of those neighbours, for the four sides."""
    every, first, last = slice(None), slice(None, -1), slice(1, None)
    pairs = [((first, every), (last, every)), ((every, first), (every, last))]
    return [p for a, b in pairs for p in ((a, b), (b, a))]
