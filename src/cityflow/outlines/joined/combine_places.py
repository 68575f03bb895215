"""Search areas of footprints: around every building region, and around walls outside of regions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon

from cityflow.core.arrays import BoolArray, Float32Array, IntArray
from cityflow.core.grid import Bounds, Grid
from cityflow.core.points import HIGH_VEGETATION
from cityflow.outlines.from_heights.regions import (
    ROUGH_M,
    Region,
    RegionParameters,
    RegionSurface,
    cells_polygon,
    disc,
    roughness,
)
from cityflow.outlines.joined.combine_evidence import Surroundings
from cityflow.outlines.joined.combine_wall_bases import KnownWall

_MARGIN_M = 4.0
"""Surroundings of a region: as far as a wall may go on beyond what was seen of it."""
_LEAST_CELLS = 12
"""Fewer cells tell no roughness; set by hand on synthetic towns."""
_LOOSE_SHARE = 0.7
"""Along a wall above a lower roof two cells of three are at the step; set by hand, as are those below."""
_SLOT_M, _SLOT_DEPTH_M, _SLOT_SHARE = 2.4, 1.5, 0.7
"""Width of a gap between houses; how much lower than both it is, at least; and the share of their height that it reaches."""
_UNSEEN_M2, _ISLAND_M = 1.0, 4.0
"""Smaller holes of the surface decide nothing; what is narrower amid holes is a part of them: lone depths are often false. Set by hand."""
_WIDE_M = 1.0
"""A hole is wide where a disc of this diameter fits in; set by hand."""
_TOUCH_CELLS = 2
"""A hole so near touches a region."""
_TOGETHER_M = 3.0
"""Walls without a roof farther apart than this are not of one building."""


class Places:
    """The surface, its building mask and its walls, to be asked for one place after the other.

    Parameters
    ----------
    surface : RegionSurface
    mask : (rows, cols) bool, all building regions
    walls : of the whole area
    parameters : what is nearly terrain, and what is rough
    """

    def __init__(
        self, surface: RegionSurface, mask: BoolArray, walls: Sequence[KnownWall], parameters: RegionParameters
    ) -> None:
        self._grid, self._mask, self._height = surface.grid, mask, surface.ndsm
        self._low = np.isfinite(surface.ndsm) & (np.nan_to_num(surface.ndsm) < parameters.minimum_height_m)
        self._low &= ~mask & (surface.klass != HIGH_VEGETATION)
        self._rough = roughness(surface.ndsm) > ROUGH_M
        self._loose = ndimage.uniform_filter(self._rough.astype(np.float32), 3) > _LOOSE_SHARE
        self._slot = slots(surface.ndsm, surface.grid.cell)
        # Between loose cells a single one that passes for a roof is none.
        self._loose = ndimage.binary_closing(self._loose | self._slot, np.ones((3, 3)))
        self._holes = _holes(surface, mask)
        area = shapely.box(*surface.grid.bounds)
        self._walls = [w for w in walls if shapely.intersects(w.wall.line, area)]
        self._lines = np.array([w.wall.line for w in self._walls], dtype=object)
        self._tree = shapely.STRtree(self._lines)

    def around(self, region: Region, reach_m: float) -> tuple[Surroundings, list[KnownWall]]:
        """What is known around a region, and the walls within `reach_m` of it."""
        own = np.zeros(self._grid.shape, bool)
        r = round((self._grid.y_max - region.grid.y_max) / self._grid.cell)
        c = round((region.grid.x_min - self._grid.x_min) / self._grid.cell)
        trimmed, r_0, c_0 = _trimmed(region.mask, r, c, self._grid.shape)
        own[r_0 : r_0 + trimmed.shape[0], c_0 : c_0 + trimmed.shape[1]] = trimmed
        extent = [region.polygon(), *self._holes_beside(own, region.grid.bounds)]
        numbers = np.unique(self._tree.query(extent, predicate="dwithin", distance=reach_m)[1])
        bounds = shapely.total_bounds([*self._lines[numbers], *extent, shapely.box(*region.grid.bounds)])
        rows, cols, grid = self._window(tuple(bounds.tolist()))
        return self._surroundings(rows, cols, grid, own[rows, cols]), [self._walls[k] for k in numbers.tolist()]

    def _holes_beside(self, own: BoolArray, bounds: Bounds) -> list[Polygon]:
        """Those that touch a region, which may hide the rest of its roof."""
        rows, cols, _ = self._window(bounds)
        beside = ndimage.binary_dilation(own[rows, cols], iterations=_TOUCH_CELLS)
        numbers = np.setdiff1d(self._holes[rows, cols][beside], 0)
        return [cells_polygon(self._holes == k, self._grid) for k in numbers.tolist()]

    def _surroundings(self, rows: slice, cols: slice, grid: Grid, own: BoolArray) -> Surroundings:
        part = rows, cols
        return Surroundings(
            grid, own, self._mask[part] & ~own, self._low[part], self._height[part], self._loose[part], self._slot[part],
            self._holes[part] > 0,
        )  # fmt: skip

    def lonely(self, reach_m: float) -> list[tuple[Surroundings, list[KnownWall]]]:
        """Groups of walls farther than `reach_m` from every region, with what is known around them."""
        numbers = self._without_region(reach_m)
        result = []
        for group in self._groups(numbers):
            rows, cols, grid = self._window(tuple(shapely.total_bounds(self._lines[group]).tolist()))
            around = self._surroundings(rows, cols, grid, np.zeros(grid.shape, bool))
            result.append((around, [self._walls[k] for k in group.tolist()]))
        return result

    def rough_share(self, polygon: Polygon) -> float:
        """Share of the cells in a polygon, its rim left out, that are as rough as foliage; 0 where too few are left."""
        rows, cols, grid = self._window(polygon.bounds)
        x, y = grid.centres()
        inside = shapely.contains_xy(shapely.buffer(polygon, -grid.cell), x, y)
        return float(self._rough[rows, cols][inside].mean()) if inside.sum() >= _LEAST_CELLS else 0.0

    def _without_region(self, reach_m: float) -> IntArray:
        row, col = np.nonzero(self._mask)
        x, y = self._grid.x_centres()[col], self._grid.y_centres()[row]
        if not len(x) or not len(self._lines):
            return np.arange(len(self._lines))
        regions = shapely.STRtree(shapely.points(x, y))
        near = np.unique(regions.query(self._lines, predicate="dwithin", distance=reach_m)[0])
        return np.setdiff1d(np.arange(len(self._lines)), near)

    def _groups(self, numbers: IntArray) -> list[IntArray]:
        lines = self._lines[numbers]
        if len(lines) < 2:
            return []
        a, b = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=_TOGETHER_M)
        links = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(len(lines), len(lines)))
        count, label = connected_components(links, directed=False)
        groups = [numbers[label == k] for k in range(count)]
        return [g for g in groups if len(g) > 1]

    def _window(self, bounds: Bounds) -> tuple[slice, slice, Grid]:
        """The part of the raster over the bounds and a margin."""
        grid, margin = self._grid, _MARGIN_M
        row_0, col_0 = grid.indices(np.array([bounds[0] - margin]), np.array([bounds[3] + margin]))
        row_1, col_1 = grid.indices(np.array([bounds[2] + margin]), np.array([bounds[1] - margin]))
        r_0, r_1 = max(int(row_0[0]), 0), min(int(row_1[0]) + 1, grid.rows)
        c_0, c_1 = max(int(col_0[0]), 0), min(int(col_1[0]) + 1, grid.cols)
        own = Grid(grid.x_min + c_0 * grid.cell, grid.y_max - r_0 * grid.cell, grid.cell, r_1 - r_0, c_1 - c_0)
        return slice(r_0, r_1), slice(c_0, c_1), own


def _holes(surface: RegionSurface, mask: BoolArray) -> IntArray:
    """(rows, cols) numbers of the holes that images leave in the surface, with islands in them, 0 elsewhere.

    What the survey's end opens is no hole, nor what the raster's does.
    """
    if surface.highest:
        return np.zeros(mask.shape, np.int64)
    cell = surface.grid.cell
    margin = len(island := disc(_ISLAND_M / 2, cell))
    empty = np.pad(surface.holes | mask, margin)
    whole = ndimage.binary_closing(empty, island)[margin:-margin, margin:-margin] & ~mask & _near(surface.holes, cell)
    labels, count = ndimage.label(whole)
    beyond = np.pad(~np.isfinite(surface.ndsm), 1, constant_values=True)
    beside = ndimage.binary_dilation(beyond, np.ones((3, 3)))[1:-1, 1:-1]
    closed = np.bincount(labels.ravel(), minlength=count + 1) * cell**2 >= _UNSEEN_M2
    closed[np.unique(labels[beside])] = False
    closed[0] = False
    return np.where(closed[labels], labels, 0)


def _near(holes: BoolArray, cell: float) -> BoolArray:
    """(rows, cols) cells within half of what makes an island of a wide hole: gaps between houses are none."""
    wide = ndimage.binary_opening(holes, disc(_WIDE_M / 2, cell))
    return np.asarray(ndimage.distance_transform_edt(~wide) * cell <= _ISLAND_M / 2) if wide.any() else wide


def slots(ndsm: Float32Array, cell: float) -> BoolArray:
    """(rows, cols) True in narrow gaps between high roofs, also where the surface bridges them halfway up."""
    height = np.nan_to_num(ndsm)
    across, aslant = max(round(_SLOT_M / cell), 3), max(round(_SLOT_M / cell / np.sqrt(2)), 3)
    lines = np.ones((1, across)), np.ones((across, 1)), np.eye(aslant), np.eye(aslant)[::-1]
    closed = np.max([ndimage.grey_closing(height, footprint=line > 0) for line in lines], axis=0)
    return np.asarray((closed - height > _SLOT_DEPTH_M) & (height < _SLOT_SHARE * closed))


def _trimmed(mask: BoolArray, row: int, col: int, shape: tuple[int, int]) -> tuple[BoolArray, int, int]:
    """The part of a mask, whose first cell lies at (row, col), that lies inside a raster; and where that begins."""
    r_0, c_0 = max(-row, 0), max(-col, 0)
    r_1, c_1 = min(mask.shape[0], shape[0] - row), min(mask.shape[1], shape[1] - col)
    return mask[r_0:r_1, c_0:c_1], row + r_0, col + c_0
