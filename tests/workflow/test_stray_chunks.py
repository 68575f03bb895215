from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cityflow.core.grid import Grid, Tile, lattice_grid
from cityflow.flow.store import Store
from cityflow.io.crs import resolve
from cityflow.io.rasters.surface_zarr import create, image_layers, write_tile
from cityflow.workflow.stray_chunks import remove_strays

TILE_M, CELL = 50.0, 5.0


@dataclass(frozen=True)
class _Known:
    """What is asked of a survey."""

    tiles: dict[str, Tile]
    zarr: str = "surface.zarr"

    @property
    def lattice(self) -> _Known:
        return self

    @property
    def source(self) -> _Known:
        return self


def test_chunks_of_tiles_that_left_the_survey_go_and_others_stay(tmp_path: Path) -> None:
    store, lattice = Store.open(tmp_path), lattice_grid(TILE_M, CELL)
    tiles = [Tile(-1, 3, TILE_M), Tile(0, 3, TILE_M), Tile(0, 4, TILE_M)]
    create(store.zarr_store("surface.zarr"), lattice, 10, resolve("EPSG:7415"), image_layers(3, "uint8"))
    for tile in tiles:
        grid = Grid.covering(tile.bounds, CELL)
        values: dict[str, Any] = {"dsm": np.ones(grid.shape, np.float32), "ortho": np.ones((3, *grid.shape), np.uint8)}
        write_tile(store.zarr_store("surface.zarr"), lattice, grid, values)
    whole = {p for p in store.find("surface.zarr") if "/c/" in p}
    known: Any = _Known({t.name: t for t in tiles})
    assert remove_strays(store, known) == 0
    known = _Known({t.name: t for t in tiles[1:]})
    assert remove_strays(store, known) == 1
    left = {p for p in store.find("surface.zarr") if "/c/" in p}
    assert whole - left == {"surface.zarr/dsm/c/999996/999999", "surface.zarr/ortho/c/0/999996/999999"}
