"""What a window of the surface costs a building: `read_layers` (xarray, opened once per process) and `read_windows`, by which tasks read (chunks are held
against their records), beside bare zarr, in turns within one run.

``python benchmarks/surface_windows.py [--tiles 20] [--tile 500] [--window 60] [--rounds 300]``; cells. Layers are those of a building from LiDAR.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from cityflow.core.grid import Grid, lattice_grid
from cityflow.flow.hashing import sha256_of
from cityflow.flow.store import Store
from cityflow.handover.surface_windows import read_windows
from cityflow.io.crs import resolve
from cityflow.io.rasters.surface_dataset import read_layers
from cityflow.io.rasters.surface_zarr import LAYERS, create, write_tile

NAMES = ("dsm", "dtm", "class")
CELL = 0.5


def surface(folder: Path, tiles: int, tile: int) -> tuple[str, Grid]:
    """A square city of `tiles` × `tiles` tiles on the lattice; four of them written, which are read."""
    grid = Grid(0.0, tiles * tile * CELL, CELL, tiles * tile, tiles * tile)
    path, lattice = str(folder / "surface.zarr"), lattice_grid(tile * CELL, CELL)
    create(path, lattice, tile, resolve("EPSG:28992"), extent=grid)
    rng = np.random.default_rng(1)
    for k in range(4):
        part = Grid((k % 2) * tile * CELL, grid.y_max - (k // 2) * tile * CELL, CELL, tile, tile)
        values = {n: rng.normal(5, 3, part.shape).astype(LAYERS[n].dtype) for n in ("dsm", "dtm")}
        write_tile(path, lattice, part, {**values, "class": np.full(part.shape, 6, np.uint8)})
    return path, grid


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, value in (("tiles", 20), ("tile", 500), ("window", 60), ("rounds", 300)):
        parser.add_argument(f"--{name}", type=int, default=value)
    a = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path, grid = surface(Path(folder), a.tiles, a.tile)
        rng = np.random.default_rng(2)
        places = rng.integers(0, 2 * a.tile - a.window, (a.rounds, 2))
        group: Any = zarr.open_group(path, mode="r")
        arrays = [group[name] for name in NAMES]
        lattice = lattice_grid(a.tile * CELL, CELL)
        first_row, first_col = (part.start for part in lattice.slices(grid))

        def through_xarray(row: int, col: int) -> object:
            x, y = col * CELL, grid.y_max - row * CELL
            return read_layers(path, lattice, (x, y - a.window * CELL, x + a.window * CELL, y), NAMES)

        bare_store = Store.open(folder)
        chunks = [p for p in bare_store.find("surface.zarr") if "/c/" in p]
        store = bare_store.expecting({p: (len(d), sha256_of(d)) for p, d in bare_store.read_many(chunks)})

        def held_against_records(row: int, col: int) -> object:
            x, y = col * CELL, grid.y_max - row * CELL
            bounds = (x, y - a.window * CELL, x + a.window * CELL, y)
            return read_windows(store, "surface.zarr", lattice, bounds, NAMES)

        def _part(array: Any, row: int, col: int) -> object:
            top, left = first_row + row, first_col + col
            return array[top : top + a.window, left : left + a.window]

        def opened_once(row: int, col: int) -> object:
            return [_part(array, row, col) for array in arrays]

        def opened_each_time(row: int, col: int) -> object:
            again: Any = zarr.open_group(path, mode="r")
            return [_part(again[name], row, col) for name in NAMES]

        ways: dict[str, Callable[[int, int], object]] = {
            "xarray, opened once": through_xarray, "the same, chunks held against records": held_against_records,
             "zarr, opened once": opened_once, "zarr, opened for each building": opened_each_time,
        }  # fmt: skip
        spent = {name: np.empty(a.rounds) for name in ways}
        for way in ways.values():
            way(0, 0)
        for k, (row, col) in enumerate(places.tolist()):
            for name, way in ways.items():
                start = time.perf_counter()
                way(row, col)
                spent[name][k] = time.perf_counter() - start
    bare = np.median(spent["zarr, opened once"])
    for name, seconds in spent.items():
        print(f"{name:40} {1000 * np.median(seconds):6.2f} ms  {np.median(seconds) / bare:5.2f} x")


if __name__ == "__main__":
    main()
