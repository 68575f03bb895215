"""One surface from the points of many depth maps, in the world or in a tilted frame.

Each cell takes the height that most evidence near its centre agrees on; neighbours on the same surface steady it; where that
floats, the cell chooses again among its other points, and what still floats goes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Bounds, Grid
from cityflow.core.heap import hand_back_heap
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.surface.fuse_cells import CellPoints, Weighing, cell_points, chosen, kept_in_place, not_below
from cityflow.surface.fuse_fill import fill_from_below
from cityflow.surface.fuse_modes import ModeRule, modes, modes_again, modes_instead
from cityflow.surface.fuse_planes import again_on_planes, on_planes, without_specks
from cityflow.surface.steady import REACH_CELLS, noise_of

STRIP_CELLS = 3_200_000
"""Cells at a time, but for those around a strip; bounds memory, no result depends on it."""
MORE_CELLS = 0.15
"""A strip may have so much more, where that spares another one with all that is around it."""

PointSource = ImagePoints | Callable[[Bounds], ImagePoints]
"""Points, or who reads those within bounds (more do no harm): then no more than a strip of them is in memory."""


def points_within(source: PointSource, bounds: Bounds) -> ImagePoints:
    """All points that a source has within bounds, and perhaps others."""
    return source if isinstance(source, ImagePoints) else source(bounds)


@runtime_checkable
class InParts(Protocol):
    """A source that may also give its points in parts, as it has them."""

    def parts(self, bounds: Bounds) -> Sequence[ImagePoints]: ...


def parts_within(source: PointSource, bounds: Bounds) -> Sequence[ImagePoints]:
    """All points that a source has within bounds, and perhaps others, in one part or more; what a source has in parts is not copied."""
    return source.parts(bounds) if isinstance(source, InParts) else [points_within(source, bounds)]


RADIUS_CELLS = 1.4
"""Points this near to a cell's centre speak for it, cells: its corners and a little more; set by hand on simulated depth maps, as are those below."""
WIDE_RADIUS_CELLS = 1.6
"""And this near where there are none, cells."""
BAND_CELLS = 2.5
"""Points of one surface lie within this height, cells."""
BAND_SIGMAS = 3.0
"""But at least this many expected standard deviations."""
HALF_VIEWS = 1.0
"""This many agreeing partners give a point half its weight."""
ABOVE_DEG = 25.0
"""Views nearer to the vertical see a surface from above, degrees: those of a nadir camera."""
BENEATH_CELLS = 3.0
"""Slanting views' points so far below the surface seen from above lie under it, cells."""
BESIDE_CELLS = 2
"""But not so near to a step of that surface, cells."""
LEAST_SUPPORT = 0.03
"""Weight of points below which a cell is a hole."""
PLANE_CELLS = 2.0
"""Neighbours this far on the same surface steady a cell, cells."""
SPECK_STEP_CELLS = 3.0
"""A patch ends at a step above this, cells."""
RIM_CELLS = 8
"""Farther from all points there is no surface, nor what one depends on: modes, planes and steps reach less far one after the other, cells."""
FILL_STEP_M = 0.5
"""Heights around a hole with a wider gap are two surfaces, metres."""
FILL_SLOPE = 0.3
"""And wider by this share of the distance between their places."""
STEP_M = 0.5
"""Two surfaces in a cell are at least this far apart, metres."""


class FuseParameters(Parameters):
    """How points become the surface."""

    lower_share: float = Field(
        0.85,
        ge=0,
        le=10,
        description="of two surfaces in a cell the lower one is used if it has at least this share of the weight",
    )
    speck_cells: int = Field(24, ge=1, le=400, description="patches of fewer cells are floaters")
    fill_m: float = Field(8.0, ge=0, le=100, description="holes are filled this far from measured cells, metres")

    @property
    def halo_cells(self) -> int:
        """Cells around a tile whose points a cell of the tile depends on, without filling; the surface is made twice, specks choose again."""
        chosen = int(np.ceil(WIDE_RADIUS_CELLS + PLANE_CELLS)) + self.speck_cells + 1
        again = int(np.ceil(PLANE_CELLS)) + self.speck_cells + 1
        return 2 * chosen + again + BESIDE_CELLS

    def reach_m(self, cell_m: float) -> float:
        """Points are needed this far around a tile, for its cells, to steady them and to fill holes, metres."""
        return self.halo_cells * cell_m + max(self.fill_m, REACH_CELLS * cell_m)


@dataclass(frozen=True, slots=True)
class Fused:
    """A fused surface; all (rows, cols) of `grid`, which may be that of a tilted frame.

    Attributes
    ----------
    dsm : float32, height at the cell's centre, metres; NaN in holes
    count : uint32, points in the cell
    sigma : float32, expected standard deviation of the height, metres; NaN in holes
    """

    grid: Grid
    dsm: Float32Array
    count: NDArray[np.uint32]
    sigma: Float32Array


def fuse(points: PointSource, grid: Grid, parameters: FuseParameters | None = None) -> Fused:
    """The surface over `grid` of points in its frame (heights count towards the cameras).

    Cells nearer than `halo_cells` to the edge of the grid may differ from those of a larger one. Works strip by strip, so that memory does not grow
    with the grid; strips do not show.
    """
    return _fused(points, grid, parameters or FuseParameters(), None)


def fused_with_noise(points: PointSource, grid: Grid, p: FuseParameters) -> tuple[Fused, Float32Array]:
    """As `fuse`, and (rows, cols) the noise of the heights as the differences of images show it, metres (`noise_of`)."""
    noise = np.full(grid.shape, np.nan, np.float32)
    return _fused(points, grid, p, noise), noise


def _fused(points: PointSource, grid: Grid, p: FuseParameters, noise: Float32Array | None) -> Fused:
    """The surface; with `noise` (rows, cols) that of the heights goes there."""
    dsm, sigma = np.full(grid.shape, np.nan, np.float32), np.full(grid.shape, np.nan, np.float32)
    count = np.zeros(grid.shape, np.uint32)
    rows = strip_rows(grid)
    for first in range(0, grid.rows, rows):
        last = min(first + rows, grid.rows)
        low, high = max(first - p.halo_cells, 0), min(last + p.halo_cells, grid.rows)
        strip = Grid(grid.x_min, grid.y_max - low * grid.cell, grid.cell, high - low, grid.cols)
        inside = points_within(points, _grown(strip))
        some = part_with_points(inside, strip)
        if some is None:
            continue
        part, rough = _fused_strip(inside, some, p, noise is not None)
        rows_of, cols = grid.slices(some)
        own = slice(max(rows_of.start, first), max(min(rows_of.stop, last), first))
        inner = slice(own.start - rows_of.start, max(own.stop - rows_of.start, 0))
        for whole, found in ((dsm, part.dsm), (count, part.count), (sigma, part.sigma)):
            whole[own, cols] = found[inner]
        if noise is not None and rough is not None:
            noise[own, cols] = rough[inner]
    return Fused(grid, dsm, count, sigma)


def part_with_points(points: ImagePoints, grid: Grid) -> Grid | None:
    """The part of the grid around its points, outside which nothing is; None where it has none."""
    x_min, y_min, x_max, y_max = _bounds_within(points.xyz, grid.bounds)
    if x_min > x_max:
        return None
    top, left = (max(int(d / grid.cell) - RIM_CELLS, 0) for d in (grid.y_max - y_max, x_min - grid.x_min))
    bottom = min(int((grid.y_max - y_min) / grid.cell) + RIM_CELLS + 1, grid.rows)
    right = min(int((x_max - grid.x_min) / grid.cell) + RIM_CELLS + 1, grid.cols)
    return Grid(grid.x_min + left * grid.cell, grid.y_max - top * grid.cell, grid.cell, bottom - top, right - left)


@njit(cache=True, nogil=True)
def _bounds_within(xyz: FloatArray, bounds: Bounds) -> Bounds:
    """Around the points that stand in `bounds`, with their edges; the least is greater than the greatest where there are none."""
    x_0, y_0, x_1, y_1 = np.inf, np.inf, -np.inf, -np.inf
    for i in range(len(xyz)):
        x, y = xyz[i, 0], xyz[i, 1]
        if x >= bounds[0] and x <= bounds[2] and y >= bounds[1] and y <= bounds[3]:
            x_0, y_0, x_1, y_1 = min(x, x_0), min(y, y_0), max(x, x_1), max(y, y_1)
    return x_0, y_0, x_1, y_1


def strip_rows(grid: Grid) -> int:
    """Rows of a strip over a grid, which has as few strips as may be."""
    strips = max(int(np.ceil(grid.rows * grid.cols / STRIP_CELLS - MORE_CELLS)), 1)
    return -(-grid.rows // strips)


def _grown(grid: Grid) -> Bounds:
    x_min, y_min, x_max, y_max = grid.bounds
    return x_min - grid.cell, y_min - grid.cell, x_max + grid.cell, y_max + grid.cell


def _fused_strip(
    points: ImagePoints, grid: Grid, p: FuseParameters, with_noise: bool
) -> tuple[Fused, Float32Array | None]:
    weighing = Weighing(grid.cell, HALF_VIEWS, float(np.cos(np.radians(ABOVE_DEG))))
    # nobody but `_surface` holds the points of the cells, so it can let them go
    z, sigma, count, noise = _surface(cell_points(points, grid, weighing), grid, p, with_noise)
    found = Fused(grid, z.astype(np.float32), count, np.where(np.isnan(z), np.nan, sigma).astype(np.float32))
    return found, noise


def _surface(
    points: CellPoints, grid: Grid, p: FuseParameters, with_noise: bool
) -> tuple[FloatArray, Float32Array, NDArray[np.uint32], Float32Array | None]:
    """(rows, cols) heights, NaN in holes, their precision where there are some, points of each cell, and noise where it is wanted; cells whose own floats
    have a second choice."""
    count = points.in_cells
    if len(points.z) == 0:
        nothing = np.full(grid.shape, np.nan)
        return nothing, nothing.astype(np.float32), count, nothing.astype(np.float32)
    rule = ModeRule(
        RADIUS_CELLS, WIDE_RADIUS_CELLS, BAND_CELLS * grid.cell, BAND_SIGMAS, LEAST_SUPPORT, p.lower_share, STEP_M,
    )  # fmt: skip
    planes = PLANE_CELLS, BAND_CELLS * grid.cell / 2
    if points.steep.all() or not points.steep.any():
        found = modes(points, rule)
        z = on_planes(found, *planes)
    else:
        steep = chosen(points, points.steep)
        found, in_steep = modes(steep, rule), steep.in_cells
        del steep
        hand_back_heap()
        z = on_planes(found, *planes)
        points = without_what_lies_beneath(points, np.where(_specks(z, grid, p), np.nan, z).astype(np.float32), grid)
        # what is seen by steep views alone has its surface
        asked = _around(points.in_cells != in_steep, int(np.ceil(WIDE_RADIUS_CELLS - 0.5)))
        modes_again(points, rule, found, asked)
        z = again_on_planes(z, found, asked, *planes)
    specks = _specks(z, grid, p)
    if specks.any():
        # what floats may hide a surface that fewer points of the cell speak for
        modes_instead(points, rule, found, specks)
        z = again_on_planes(z, found, specks, *planes)
        z[_specks(z, grid, p)] = np.nan
    return z, found.sigma, count, noise_of(points, z, planes[1]) if with_noise else None


def without_what_lies_beneath(points: CellPoints, top: Float32Array, grid: Grid) -> CellPoints:
    """Points without those of slanting views that lie under the surface (rows, cols) that steep views see.

    Such views see the ground under crowns, and walls under eaves: many points above one another in one cell, which would outvote what stands above.
    Next to a step, or to what steep views do not see, all keep their say: steep views too widen what stands in front. The points given are used up.
    """
    side = 2 * BESIDE_CELLS + 1
    lowest = cv2.erode(np.where(np.isnan(top), np.float32(-np.inf), top), np.ones((side, side), np.uint8))
    beneath = BENEATH_CELLS * grid.cell
    return kept_in_place(points, not_below(points, lowest - beneath, top, beneath))


def _around(cells: BoolArray, by: int) -> BoolArray:
    """(rows, cols) cells that are as near to some."""
    side = 2 * by + 1
    return cv2.dilate(cells.astype(np.uint8), np.ones((side, side), np.uint8), borderValue=0).astype(np.bool_)


def _specks(z: FloatArray, grid: Grid, p: FuseParameters) -> BoolArray:
    """(rows, cols) which heights are specks."""
    return np.isfinite(z) & ~without_specks(z, SPECK_STEP_CELLS * grid.cell, p.speck_cells)


def fill_steps(
    fused: Fused, parameters: FuseParameters | None = None, part: tuple[slice, slice] = (slice(None), slice(None))
) -> FloatArray:
    """(rows, cols) of a part of the surface, with its holes filled from the lower side, `fill_m` from what was measured; NaN beyond."""
    p = parameters or FuseParameters()
    values = fused.dsm.astype(np.float64)
    return fill_from_below(values, round(p.fill_m / fused.grid.cell), FILL_STEP_M, FILL_SLOPE * fused.grid.cell, part)
