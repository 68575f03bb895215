"""Gaps too narrow for the cells of a surface: straight lines through a region along which the ground, façades or images show them from border to border.

A cell keeps its highest point, so a gap of a metre is a broken chain of low cells. Along a straight line they add up: between two blocks most
cells are far below what the roofs on both sides go on to, and some are deep; on a roof, a valley or between dormers they are not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.core.grid import Grid
from cityflow.outlines.from_heights.facade_seams import Facades, facade_seams
from cityflow.outlines.from_heights.regions import Region, RegionSurface
from cityflow.outlines.from_heights.seam_lattice import LEAST_SHARE, Lattice, Seam, roofs_beside, runs
from cityflow.outlines.from_images.image_seams import image_seams

DROP_M = 1.0
"""A cell is low where it lies deeper below both."""
END_SHARE, DEEP_SHARE = 0.25, 0.1
"""Of the cells along a line, low: in the third at either end; and deep below the roof."""
STOREY_M = 3.0
"""Deep is a storey or half of the height; oblique pulses do not see farther down between high walls."""
_CUT_M = 0.36
"""Cells with centres so near to a line are taken out: just enough to part what lies on its sides."""


def parts_of(region: Region, surface: RegionSurface, orientations: Sequence[float], least_m2: float) -> list[Region]:
    """What narrow gaps make of a region: itself, where there are none.

    Parameters
    ----------
    surface : with its points on façades, if any, sorted by x
    orientations : of its edges, radians from east, each for itself and its perpendicular
    least_m2 : smaller parts are none
    """
    grid = region.grid
    own = Grid(grid.x_min + grid.cell, grid.y_max - grid.cell, grid.cell, grid.rows - 2, grid.cols - 2)
    window = surface.grid.slices(own)
    mask = region.mask[1:-1, 1:-1]
    # Rows count downwards, so an orientation turns the other way.
    directions = [d for o in orientations for d in (-o, np.pi / 2 - o)]
    ndsm = surface.ndsm[window]
    seams = [s for d in directions for s in _seams(mask, ndsm, surface.holes[window], grid.cell, d)]
    if surface.walls is not None and surface.dtm is not None:
        facades = Facades.over(surface.walls, own, surface.dtm[window])
        seams += facade_seams(mask, ndsm, grid.cell, directions, facades)
    if surface.photographed is not None and region.area_m2 >= 2.0 * least_m2:
        seams += image_seams(mask, own, directions, surface.photographed)
    cut = _parted(mask, seams, grid.cell, least_m2)
    if (cut == mask).all():
        return [region]
    labels, count = ndimage.label(np.pad(cut, 1))
    parts = [replace(region, mask=labels == k) for k in range(1, count + 1)]
    return [p for p in parts if p.area_m2 >= least_m2]


def _parted(mask: BoolArray, seams: Sequence[Seam], cell: float, least_m2: float) -> BoolArray:
    """(rows, cols) the mask of one region without the cells of those seams that part it."""
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
    lattice = Lattice.over(mask.shape, cell, direction)
    row, col, on = lattice.row, lattice.col, lattice.on
    height, inside = np.where(on, ndsm[row, col], np.nan), on & mask[row, col]
    known = on & ~holes[row, col] & np.isfinite(height)
    roof, between = roofs_beside(height, inside)
    with np.errstate(invalid="ignore"):
        low = known & (height < roof - DROP_M)
        deep = low & (height < roof - np.minimum(roof / 2, STOREY_M))
    for line, first, after in runs(between):
        share = _share(known[line, first:after], low[line, first:after], deep[line, first:after])
        if share >= LEAST_SHARE:
            yield lattice.seam(line, first, after, share)


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
