"""Tiles of a run, and the grids of its rasters."""

from __future__ import annotations

import math
from functools import cached_property

from cityflow.core.grid import Bounds, Grid, Tile, grid_over, grown, lattice_grid, tiles_over
from cityflow.flow.task import digest_of
from cityflow.survey.surface_source import Source
from cityflow.survey.unit_entry import UnitEntry

SEEN_AROUND_M = 5.0
"""A unit waits for the surfaces this far beyond its outline, and looks no farther."""

KEPT = 4096
"""Rows and columns of tiles whose names stay at hand; set by hand."""


class Lattice:
    """Ground tiles and grids of a survey.

    Parameters
    ----------
    source : of the surface;  tile_m : edge of a ground tile, metres;  crs : code of the reference system
    """

    def __init__(self, source: Source, tile_m: float, crs: str) -> None:
        self.source, self.tile_m, self._crs = source, tile_m, crs
        self._over: dict[tuple[int, int, int, int], tuple[str, ...]] = {}

    @cached_property
    def tiles(self) -> dict[str, Tile]:
        """Ground tiles with something to see, south-west first."""
        return dict(self.source.tiles)

    @cached_property
    def grid(self) -> Grid:
        """The grid on which terrain, classes and outlines stand: the whole lattice, so that no cell moves when the survey grows."""
        return lattice_grid(self.tile_m, self.cell_m)

    @cached_property
    def product_grid(self) -> Grid:
        """The grid of the DSM, DTM and ortho that are delivered: as fine as the source is, over the whole lattice, too."""
        return lattice_grid(self.tile_m, self.source.cell_m)

    @cached_property
    def bounds(self) -> Bounds:
        """Of all ground tiles, metres."""
        return self.extent(self.cell_m).bounds

    def extent(self, cell_m: float) -> Grid:
        """The grid over all ground tiles."""
        return grid_over(self.tiles.values(), cell_m)

    @cached_property
    def cell_m(self) -> float:
        """Cell of `grid`, metres."""
        return self.source.cell_m * self.source.factor

    @cached_property
    def place(self) -> str:
        """Digest of tiles and cells, which decide on the chunk that is a tile's, and of the CRS, which is written into every raster."""
        return digest_of([self.tile_m, self.cell_m, self.source.cell_m, self._crs])

    def ring(self, name: str) -> list[str]:
        """The tile and those of its eight neighbours that exist."""
        tile = self.tiles[name]
        around = [f"{tile.col + i}_{tile.row + j}" for j in (-1, 0, 1) for i in (-1, 0, 1)]
        return [n for n in around if n in self.tiles]

    def near(self, name: str, reach_m: float) -> list[str]:
        """The tile and all others that lie within `reach_m` of it, south-west first."""
        return [t.name for t in tiles_over(self.tiles[name].buffered(reach_m), self.tile_m) if t.name in self.tiles]

    def tiles_under(self, unit: UnitEntry) -> tuple[str, ...]:
        """Every tile of which a task of the unit reads a cell or a point: what it does not wait for it must not see."""
        return self.tiles_over(grown(unit.bounds, SEEN_AROUND_M))

    def tiles_over(self, bounds: Bounds) -> tuple[str, ...]:
        """The tiles of the survey that meet `bounds`, south-west first; one object for all bounds over the same tiles, as long as it is at hand."""
        m = self.tile_m
        place = math.floor(bounds[0] / m), math.floor(bounds[1] / m), math.ceil(bounds[2] / m), math.ceil(bounds[3] / m)
        found = self._over.get(place)
        if found is None:
            if len(self._over) >= KEPT:
                self._over.clear()
            found = self._over[place] = tuple(t.name for t in tiles_over(bounds, m) if t.name in self.tiles)
        return found
