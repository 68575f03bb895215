"""The fused surface of one tile, and of several tiles together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import Float32Array
from cityflow.core.grid import Bounds, Grid
from cityflow.surface.fuse import (
    Fused,
    FuseParameters,
    PointSource,
    fill_steps,
    fused_with_noise,
    parts_within,
    strip_rows,
)
from cityflow.surface.overview import surface_colour
from cityflow.surface.steady import REACH_CELLS, steadied

COLOUR_REACH_CELLS = 3.0
"""Points this near to the surface give it its colour, cells; set by hand."""


@dataclass(frozen=True, slots=True)
class FusedTile:
    """A fused surface with its colour.

    Attributes
    ----------
    surface : heights, counts and precision on the fine grid
    filled : (rows, cols) float32, the same with holes filled from the lower side, metres; NaN far from points
    factor : fine cells along one cell of the working grid
    colour : (rows / factor, cols / factor, bands) float32 mean colour of the surface on the working grid; NaN without; no bands for grey images
    """

    surface: Fused
    filled: Float32Array
    factor: int
    colour: Float32Array

    @property
    def grid(self) -> Grid:
        return self.surface.grid


def fused_tile(
    points: PointSource, bounds: Bounds, cell_m: float, factor: int, parameters: FuseParameters
) -> FusedTile:
    """Fuse the points over a tile.

    Parameters
    ----------
    points : world points over the tile and `parameters.reach_m(cell_m)` around it, or who reads them within bounds
    bounds : of the tile, multiples of the working cell
    cell_m, factor : fine cell, metres, and how many of them make one of the working grid
    """
    core = fine_grid(bounds, cell_m, factor)
    halo = int(np.ceil(parameters.reach_m(cell_m) / (cell_m * factor))) * factor
    wide = Grid(
        core.x_min - halo * cell_m, core.y_max + halo * cell_m, cell_m, core.rows + 2 * halo, core.cols + 2 * halo
    )
    found, noise = fused_with_noise(points, wide, parameters)
    part = (slice(halo, halo + core.rows), slice(halo, halo + core.cols))
    dsm = _steadied(found, noise, part)
    filled = np.where(np.isnan(dsm), fill_steps(found, parameters, part).astype(np.float32), dsm)
    surface = Fused(core, dsm, found.count[part].copy(), found.sigma[part].copy())
    return FusedTile(surface, filled, factor, _colour(points, surface, factor))


def _steadied(found: Fused, noise: Float32Array, part: tuple[slice, slice]) -> Float32Array:
    """Heights of a part, averaged as far as their noise demands. Holes are filled from heights as they were before: that needs less around a tile."""
    r = REACH_CELLS
    around = slice(part[0].start - r, part[0].stop + r), slice(part[1].start - r, part[1].stop + r)
    return steadied(found.dsm[around], noise[around], found.grid.cell)[r:-r, r:-r].copy()


def fine_grid(bounds: Bounds, cell_m: float, factor: int) -> Grid:
    """Whole cells of the working grid over `bounds`, cut into fine ones."""
    work = Grid.covering(bounds, cell_m * factor)
    return Grid(work.x_min, work.y_max, cell_m, work.rows * factor, work.cols * factor)


def side_by_side(tiles: Sequence[FusedTile], bounds: Bounds, cell_m: float, factor: int) -> FusedTile:
    """What tiles that do not overlap show within `bounds`; where there is none, holes."""
    grid = fine_grid(bounds, cell_m, factor)
    bands = max((t.colour.shape[2] for t in tiles), default=0)
    blank = np.full(grid.shape, np.nan, np.float32)
    whole = FusedTile(
        Fused(grid, blank.copy(), np.zeros(grid.shape, np.uint32), blank.copy()), blank.copy(), factor,
        np.full((grid.rows // factor, grid.cols // factor, bands), np.nan, np.float32),
    )  # fmt: skip
    for tile in tiles:
        _lay(tile, whole)
    return whole


def _lay(tile: FusedTile, whole: FusedTile) -> None:
    grid, into = tile.grid, whole.grid
    row, col = round((into.y_max - grid.y_max) / grid.cell), round((grid.x_min - into.x_min) / grid.cell)
    r_0, r_1 = max(row, 0), min(row + grid.rows, into.rows)
    c_0, c_1 = max(col, 0), min(col + grid.cols, into.cols)
    if r_0 >= r_1 or c_0 >= c_1:
        return
    to, part = np.s_[r_0:r_1, c_0:c_1], np.s_[r_0 - row : r_1 - row, c_0 - col : c_1 - col]
    for name in ("dsm", "count", "sigma"):
        getattr(whole.surface, name)[to] = getattr(tile.surface, name)[part]
    whole.filled[to] = tile.filled[part]
    if tile.colour.shape[2]:
        f = tile.factor
        whole.colour[r_0 // f : r_1 // f, c_0 // f : c_1 // f] = tile.colour[
            (r_0 - row) // f : (r_1 - row) // f, (c_0 - col) // f : (c_1 - col) // f
        ]


def _colour(points: PointSource, fused: Fused, factor: int) -> Float32Array:
    """Colour of the surface on the working grid, strip by strip."""
    grid, parts = fused.grid, []
    rows = max(strip_rows(grid) // factor, 1) * factor
    for first in range(0, grid.rows, rows):
        last = min(first + rows, grid.rows)
        strip = Grid(grid.x_min, grid.y_max - first * grid.cell, grid.cell, last - first, grid.cols)
        inside = parts_within(points, strip.bounds)
        found = surface_colour(inside, fused.dsm[first:last], strip, factor, COLOUR_REACH_CELLS * grid.cell)
        none: NDArray[np.float32] = np.empty(((last - first) // factor, grid.cols // factor, 0), np.float32)
        parts.append(none if found is None else found)
    return np.concatenate(parts)
