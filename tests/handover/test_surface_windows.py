"""Windows of the surfaces of a run: every chunk under a window is held against what was written, and no other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cityflow.core.grid import Bounds, Grid, lattice_grid
from cityflow.flow import damage
from cityflow.flow.damage import DamagedFileError, Written
from cityflow.flow.hashing import sha256_of
from cityflow.flow.store import Store
from cityflow.handover.surface_windows import read_windows
from cityflow.io.crs import resolve
from cityflow.io.rasters.surface_zarr import LAYERS, create, write_tile

CELL, CELLS, ZARR = 0.5, 40, "surface.zarr"
TILE_M = CELL * CELLS
LATTICE = lattice_grid(TILE_M, CELL)
CITY = Grid(85000.0, 447560.0, CELL, CELLS, 2 * CELLS)
WEST: Bounds = (85001.0, 447545.0, 85010.0, 447550.0)
BOTH: Bounds = (85015.0, 447545.0, 85025.0, 447550.0)


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """Two tiles of two layers, as their task has left them."""
    bare = Store.open(tmp_path / "run")
    create(place := bare.zarr_store(ZARR), LATTICE, CELLS, resolve("EPSG:28992"), extent=CITY)
    for k in range(2):
        part = Grid(CITY.x_min + k * TILE_M, CITY.y_max, CELL, CELLS, CELLS)
        values = {n: np.full(part.shape, k + 1, LAYERS[n].dtype) for n in ("dsm", "class")}
        write_tile(place, LATTICE, part, values)
    written: dict[str, Written] = {}
    for path in bare.find(ZARR):
        if "/c/" in path:
            written[path] = len(data := bare.read_bytes(path)), sha256_of(data)
    assert len(written) == 4
    return bare.expecting(written)


def chunk(store: Store, layer: str, number: int) -> str:
    return [path for path in store.find(ZARR) if f"/{layer}/c/" in path][number]


def test_whole_chunks_are_read_and_looked_at_once(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    _, layers = read_windows(store, ZARR, LATTICE, BOTH, ("dsm", "class"))
    assert sorted(np.unique(layers["dsm"]).tolist()) == [1, 2]
    monkeypatch.setattr(damage, "sha256_of_file", lambda _: pytest.fail("looked at twice"))
    read_windows(store, ZARR, LATTICE, WEST, ("dsm", "class"))


@pytest.mark.parametrize("harm", ["cut", "changed", "gone"])
def test_a_damaged_chunk_is_named_by_who_reads_it_and_by_nobody_else(store: Store, harm: str) -> None:
    read_windows(store, ZARR, LATTICE, BOTH, ("dsm", "class"))
    path = chunk(store, "dsm", 1)
    data = store.expecting({}).read_bytes(path)
    if harm == "gone":
        store.remove(path)
    else:
        store.write_bytes(path, data[:-1] if harm == "cut" else bytes([data[0] ^ 1]) + data[1:])
    read_windows(store, ZARR, LATTICE, WEST, ("dsm", "class"))
    read_windows(store, ZARR, LATTICE, BOTH, ("class",))
    with pytest.raises(DamagedFileError) as caught:
        read_windows(store, ZARR, LATTICE, BOTH, ("dsm",))
    assert caught.value.where == path
    assert store.expected is not None
    assert path in store.expected.found
