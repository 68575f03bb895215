"""Gaps too narrow for the cells of a surface: straight lines through a region along which the ground, or a façade, shows from border to border.

A cell keeps its highest point, so a gap of a metre is a broken chain of low cells. Along a straight line they add up: between two blocks most
cells are far below what the roofs on both sides go on to, and some are deep; on a roof, a valley or between dormers they are not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.outlines.from_heights.regions import Region, RegionSurface

STEP_M = 0.25
"""Lattice along and across a line."""
NEAR_M, FAR_M = 1.25, 2.25
"""Where the roofs on both sides are taken; their slope is that between these."""
DROP_M = 1.0
"""A cell is low where it lies deeper below both."""
LOW_SHARE, END_SHARE, DEEP_SHARE = 0.4, 0.25, 0.1
"""Of the cells along a line, low: in all, and in the third at either end; and deep below the roof."""
STOREY_M = 3.0
"""Deep is a storey or half of the height; oblique pulses do not see farther down between high walls."""
LEAST_RUN_M = 4.0
_BEYOND_M = 1.25
"""A line is cut so much beyond its ends, where corners of the roofs beside it hide them."""
_CUT_M = 0.36
"""Cells with centres so near to a line are taken out: just enough to part what lies on its sides."""


@dataclass(frozen=True, slots=True)
class Seam:
    """A line from start to end, (x, y) in cells (col, row), and the share of low cells along it."""

    start: FloatArray
    end: FloatArray
    share: float


def parts_of(region: Region, surface: RegionSurface, orientations: Sequence[float], least_m2: float) -> list[Region]:
    """What narrow gaps make of a region: itself, where there are none.

    Parameters
    ----------
    orientations : of its edges, radians from east, each for itself and its perpendicular
    least_m2 : smaller parts are none
    """
    grid = region.grid
    own = Grid(grid.x_min + grid.cell, grid.y_max - grid.cell, grid.cell, grid.rows - 2, grid.cols - 2)
    window = surface.grid.slices(own)
    mask = region.mask[1:-1, 1:-1]
    # Rows count downwards, so an orientation turns the other way.
    directions = [d for o in orientations for d in (-o, np.pi / 2 - o)]
    cut = parted(mask, surface.ndsm[window], surface.holes[window], grid.cell, directions, least_m2)
    if (cut == mask).all():
        return [region]
    labels, count = ndimage.label(np.pad(cut, 1))
    parts = [replace(region, mask=labels == k) for k in range(1, count + 1)]
    return [p for p in parts if p.area_m2 >= least_m2]


def parted(
    mask: BoolArray, ndsm: Float32Array, holes: BoolArray, cell: float, directions: Sequence[float], least_m2: float
) -> BoolArray:
    """(rows, cols) the mask of one region without the cells of seams that part it.

    Parameters
    ----------
    mask : (rows, cols) bool, one region
    ndsm : (rows, cols) float32, metres above terrain; holes filled
    holes : (rows, cols) bool, cells without a measurement, which say nothing
    directions : of the region's edges, radians in rows and columns (x right, y down)
    least_m2 : smaller parts are none
    """
    seams = [s for d in directions for s in _seams(mask, ndsm, holes, cell, d)]
    result, parts = mask, _parts(mask, cell, least_m2)
    for seam in sorted(seams, key=lambda s: (-s.share, *s.start, *s.end)):
        cut = result & ~_cells_of(seam, mask.shape, cell)
        if (number := _parts(cut, cell, least_m2)) > parts:
            result, parts = cut, number
    return result


def _parts(mask: BoolArray, cell: float, least_m2: float) -> int:
    labels, _ = ndimage.label(mask)
    return int((np.bincount(labels.ravel())[1:] * cell**2 >= least_m2).sum())


def _seams(mask: BoolArray, ndsm: Float32Array, holes: BoolArray, cell: float, direction: float) -> Iterator[Seam]:
    """Lines in one direction along which most cells between two roofs are low, the best of those beside each other."""
    place = _lattice(mask.shape, cell, direction)
    row, col, on = place
    height, inside = np.where(on, ndsm[row, col], np.nan), on & mask[row, col]
    known = on & ~holes[row, col] & np.isfinite(height)
    roof, between = _roofs_beside(height, inside)
    with np.errstate(invalid="ignore"):
        low = known & (height < roof - DROP_M)
        deep = low & (height < roof - np.minimum(roof / 2, STOREY_M))
    step, beyond = STEP_M / cell, round(_BEYOND_M / STEP_M)
    along, centre = np.array([np.cos(direction), np.sin(direction)]), np.array(mask.shape[::-1]) / 2
    across = np.array([-along[1], along[0]])
    middle = (np.array(row.shape) - 1) / 2
    for v in np.flatnonzero(between.any(axis=1)):
        for first, after in _runs(between[v]):
            share = _share(known[v, first:after], low[v, first:after], deep[v, first:after])
            if share >= LOW_SHARE:
                ends = [
                    centre + step * ((u - middle[1]) * along + (v - middle[0]) * across)
                    for u in (first - beyond, after - 1 + beyond)
                ]
                yield Seam(ends[0], ends[1], share)


def _lattice(shape: tuple[int, int], cell: float, direction: float) -> tuple[IntArray, IntArray, BoolArray]:
    """Rows and columns of a lattice of lines in a direction, (lines, places), and which of them lie on the raster."""
    reach = int(np.ceil(np.hypot(*shape) * cell / STEP_M / 2)) + 1
    n = np.arange(-reach, reach + 1) * STEP_M / cell
    c, s = np.cos(direction), np.sin(direction)
    col = np.floor(shape[1] / 2 + n[None] * c - n[:, None] * s).astype(np.int64)
    row = np.floor(shape[0] / 2 + n[None] * s + n[:, None] * c).astype(np.int64)
    on = (row >= 0) & (col >= 0) & (row < shape[0]) & (col < shape[1])
    return np.clip(row, 0, shape[0] - 1), np.clip(col, 0, shape[1] - 1), on


def _roofs_beside(height: FloatArray, inside: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Height at each place that the lower of the roofs on both sides goes on to, and where there is one on either side."""
    near, far = round(NEAR_M / STEP_M), round(FAR_M / STEP_M)
    slope = NEAR_M / (FAR_M - NEAR_M)
    roof, between = np.full(height.shape, np.inf), np.ones(height.shape, bool)
    for sign in (-1, 1):
        close, beyond = np.roll(height, sign * near, axis=0), np.roll(height, sign * far, axis=0)
        roof = np.fmin(roof, close + np.clip((close - beyond) * slope, -NEAR_M, NEAR_M))
        between &= np.roll(inside, sign * near, axis=0) & np.roll(inside, sign * far, axis=0)
    return roof, between


def _runs(mask: BoolArray) -> Iterator[tuple[int, int]]:
    """First and after-last place of long runs of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(np.int8)))
    for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if (after - first) * STEP_M >= LEAST_RUN_M:
            yield first, after


def _share(known: BoolArray, low: BoolArray, deep: BoolArray) -> float:
    """Share of low cells along a run; 0 where one of its ends shows none, or none is deep."""
    third = len(known) // 3
    total = max(int(known.sum()), 1)
    ends = min(low[part].sum() / max(int(known[part].sum()), 1) for part in (slice(third), slice(-third, None)))
    return float(low.sum() / total) if ends >= END_SHARE and deep.sum() >= DEEP_SHARE * total else 0.0


def _cells_of(seam: Seam, shape: tuple[int, int], cell: float) -> BoolArray:
    """(rows, cols) cells with centres near a line."""
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]] + 0.5
    along = seam.end - seam.start
    length = float(np.hypot(*along))
    d_x, d_y = x - seam.start[0], y - seam.start[1]
    at, off = (d_x * along[0] + d_y * along[1]) / length, (d_y * along[0] - d_x * along[1]) / length
    return np.asarray((np.abs(off) * cell <= _CUT_M) & (at >= 0) & (at <= length))
