from __future__ import annotations

import hashlib
import os
import socket
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
import rioxarray  # noqa: F401  (gives arrays their `.rio`)
import xarray as xr
import zarr
from numpy.typing import NDArray

from cityflow.core.grid import FARTHEST_TILE, Grid, Tile, lattice_grid
from cityflow.core.reference import Reference
from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.io.crs import resolve
from cityflow.io.rasters.surface_dataset import chunked_surface, read_layers
from cityflow.io.rasters.surface_zarr import LAYERS, chunk_paths, create, image_layers, window_of, write_tile

CELL, TILE_CELLS = 0.5, 40
TILE_M = CELL * TILE_CELLS
LATTICE = lattice_grid(TILE_M, CELL)
CITY = Grid(85000.0, 447560.0, CELL, 3 * TILE_CELLS, 4 * TILE_CELLS)
TILES = [Tile(col, row, 20.0) for row in range(22375, 22378) for col in range(4250, 4254)]


def _grid(tile: Tile) -> Grid:
    return Grid.covering(tile.bounds, CELL)


def _layers(tile: Tile) -> dict[str, NDArray[Any]]:
    rng = np.random.default_rng([tile.col, tile.row])
    shape = (TILE_CELLS, TILE_CELLS)
    heights = {name: rng.normal(5, 3, shape) for name in ("dsm", "dsm_filled", "dtm", "ndsm")}
    heights["dsm"][3:7, 3:9] = np.nan
    masks = {
        "class": rng.integers(0, 9, shape),
        "count": rng.integers(0, 70_000, shape),
        "holes": rng.random(shape) < 0.1,
    }
    return {name: layer.astype(LAYERS[name].dtype) for name, layer in (heights | masks).items()}


@pytest.fixture
def store(tmp_path: Path, amersfoort: Reference) -> str:
    path = str(tmp_path / "run" / "surface.zarr")
    assert create(path, LATTICE, TILE_CELLS, amersfoort, extent=CITY)
    return path


def test_tiles_written_by_many_come_back_in_any_window(store: str) -> None:
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda tile: write_tile(store, LATTICE, _grid(tile), _layers(tile)), TILES))
    grid, read = read_layers(store, LATTICE, (85013.3, 447506.1, 85047.9, 447533.0))
    assert grid == Grid(85013.0, 447533.0, CELL, 54, 70)
    whole = {name: np.empty(CITY.shape, LAYERS[name].dtype) for name in LAYERS}
    for tile in TILES:
        for name, layer in _layers(tile).items():
            whole[name][CITY.slices(_grid(tile))] = layer
    for name, layer in read.items():
        assert layer.dtype == LAYERS[name].dtype
        assert np.array_equal(layer, whole[name][CITY.slices(grid)], equal_nan=layer.dtype.kind == "f")


def test_xarray_opens_it_lazily_with_crs_and_coordinates(store: str) -> None:
    write_tile(store, LATTICE, _grid(TILES[0]), _layers(TILES[0]))
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        city = chunked_surface(store)
    assert set(city.data_vars) == set(LAYERS)
    dsm = city["dsm"]
    assert dsm.chunksizes == {"y": (40, 40, 40), "x": (40, 40, 40, 40)}
    assert dsm.rio.crs.to_epsg() == 7415
    assert dsm.rio.transform()[:6] == pytest.approx(CITY.transform)
    assert dsm.rio.bounds() == pytest.approx(CITY.bounds)
    assert np.isnan(dsm.rio.nodata) or np.isnan(dsm.rio.encoded_nodata)
    assert xr.open_zarr(store, chunks=None)["dsm"].shape == LATTICE.shape
    here = dsm.sel(x=slice(85000, 85020), y=slice(447520, 447500)).to_numpy()
    assert np.array_equal(here, _layers(TILES[0])["dsm"], equal_nan=True)
    elsewhere = city.sel(x=85030.25, y=447530.25).compute()
    assert np.isnan(elsewhere["dsm"].item())
    assert elsewhere["holes"].item() is True
    assert elsewhere["count"].item() == 0
    names = {name: city[name].attrs.get("standard_name") for name in ("dsm", "dtm", "ndsm", "count")}
    assert names == {"dsm": "altitude", "dtm": "surface_altitude", "ndsm": "height", "count": None}
    flags = city["class"].attrs
    assert dict(zip(flags["flag_values"], flags["flag_meanings"].split(), strict=True))[6] == "building"


@pytest.mark.parametrize("where", ["{tmp_path}", "memory://surfaces-made-anew"])
def test_a_surface_made_anew_is_seen_by_a_process_that_had_the_former_one_open(
    where: str, tmp_path: Path, amersfoort: Reference
) -> None:
    for cells in (TILE_CELLS, TILE_CELLS // 2):
        path = Store.open(where.format(tmp_path=tmp_path)).zarr_store("surface.zarr")
        create(path, LATTICE, cells, amersfoort, replace=True, extent=CITY)
        tile = Grid(CITY.x_min, CITY.y_max, CELL, cells, cells)
        heights = np.full((cells, cells), float(cells), np.float32)
        write_tile(path, LATTICE, tile, {"dsm": heights})
        for _ in range(2):
            _, found = read_layers(path, LATTICE, tile.bounds, ["dsm"])
            assert np.array_equal(found["dsm"], heights)
        whole = chunked_surface(path)["dsm"]
        assert whole.chunksizes["y"][0] == cells
        assert whole.rio.crs.to_epsg() == 7415
        assert whole.sum().compute().item() == cells**3


def test_a_local_frame_has_no_crs(tmp_path: Path, local: Reference) -> None:
    create(str(tmp_path / "s.zarr"), LATTICE, TILE_CELLS, local, extent=CITY)
    city = chunked_surface(str(tmp_path / "s.zarr"))
    assert city["dtm"].rio.crs is None
    assert city["dtm"].rio.transform()[:6] == pytest.approx(CITY.transform)


def test_a_chunk_is_a_file_even_if_nothing_was_measured(store: str) -> None:
    nothing = {name: np.full((TILE_CELLS, TILE_CELLS), layer.fill, layer.dtype) for name, layer in LAYERS.items()}
    tile = _grid(TILES[5])
    paths = chunk_paths(LATTICE, tile, nothing, TILE_CELLS)
    assert paths[0] == f"dsm/c/{FARTHEST_TILE - 22377}/{FARTHEST_TILE + 4251}"
    assert not any((Path(store) / path).exists() for path in paths)
    write_tile(store, LATTICE, tile, nothing)
    assert all((Path(store) / path).is_file() for path in paths)


def test_only_the_tiles_own_chunks_change(store: str) -> None:
    write_tile(store, LATTICE, _grid(TILES[0]), _layers(TILES[0]))
    before = _digests(store)
    write_tile(store, LATTICE, _grid(TILES[6]), _layers(TILES[6]))
    after = _digests(store)
    assert set(after) - set(before) == set(chunk_paths(LATTICE, _grid(TILES[6]), _layers(TILES[6]), TILE_CELLS))
    assert {path: after[path] for path in before} == before


def test_an_ortho_has_bands_and_one_chunk_a_tile(tmp_path: Path, amersfoort: Reference) -> None:
    path, tile = str(tmp_path / "s.zarr"), _grid(TILES[5])
    create(path, LATTICE, TILE_CELLS, amersfoort, image_layers(3, "uint8"), extent=CITY)
    colour = np.random.default_rng(1).integers(0, 255, (3, TILE_CELLS, TILE_CELLS)).astype(np.uint8)
    write_tile(path, LATTICE, tile, {"ortho": colour})
    assert all((Path(path) / p).is_file() for p in chunk_paths(LATTICE, tile, {"ortho": colour}, TILE_CELLS))
    _, found = read_layers(path, LATTICE, tile.bounds, ["ortho"])
    np.testing.assert_array_equal(found["ortho"], colour)
    ortho = chunked_surface(path)["ortho"]
    assert ortho.dims == ("band", "y", "x")
    assert ortho["band"].to_numpy().tolist() == [1, 2, 3]


def test_the_same_arrays_give_the_same_bytes(tmp_path: Path, amersfoort: Reference) -> None:
    for name, tiles in (("a", TILES), ("b", TILES[::-1])):
        create(str(tmp_path / name), LATTICE, TILE_CELLS, amersfoort, extent=CITY)
        for tile in tiles:
            write_tile(str(tmp_path / name), LATTICE, _grid(tile), _layers(tile))
    assert _digests(str(tmp_path / "a")) == _digests(str(tmp_path / "b"))


def test_a_tile_that_is_not_made_of_chunks_is_refused(store: str) -> None:
    tile = _grid(TILES[0])
    shifted = Grid(tile.x_min + 5, tile.y_max, CELL, TILE_CELLS, TILE_CELLS)
    with pytest.raises(ValueError, match="not made of chunks"):
        write_tile(store, LATTICE, shifted, _layers(TILES[0]))
    with pytest.raises(ValueError, match="not made of chunks"):
        write_tile(store, LATTICE, tile, {"dsm": np.zeros((3, 3), np.float32)})
    with pytest.raises(ValueError, match="does not lie inside"):
        write_tile(store, LATTICE, Grid(LATTICE.x_min - TILE_M, 0.0, CELL, TILE_CELLS, TILE_CELLS), {})


def test_a_tile_may_be_several_chunks(tmp_path: Path, amersfoort: Reference) -> None:
    """Written at once or chunk by chunk, files and bytes are the same."""
    four = [TILES[k] for k in (0, 1, 4, 5)]
    corner, edge = _grid(four[2]), 2 * TILE_CELLS
    whole = Grid(corner.x_min, corner.y_max, CELL, edge, edge)
    layers = {name: np.zeros((edge, edge), layer.dtype) for name, layer in _layers(four[0]).items()}
    for tile in four:
        for name, layer in _layers(tile).items():
            layers[name][whole.slices(_grid(tile))] = layer
    for name in ("a", "b"):
        create(str(tmp_path / name), LATTICE, TILE_CELLS, amersfoort, extent=CITY)
    once = write_tile(str(tmp_path / "a"), LATTICE, whole, layers)
    parts = [path for tile in four for path in write_tile(str(tmp_path / "b"), LATTICE, _grid(tile), _layers(tile))]
    assert sorted(once) == sorted(parts)
    assert len(once) == 4 * len(layers)
    assert _digests(str(tmp_path / "a")) == _digests(str(tmp_path / "b"))


def test_creating_again_keeps_what_is_there(store: str, amersfoort: Reference) -> None:
    write_tile(store, LATTICE, _grid(TILES[0]), _layers(TILES[0]))
    before = _digests(store)
    assert not create(store, LATTICE, TILE_CELLS, amersfoort, extent=CITY)
    assert _digests(store) == before


def test_another_grid_is_refused_unless_asked_for(store: str, amersfoort: Reference, local: Reference) -> None:
    write_tile(store, LATTICE, _grid(TILES[0]), _layers(TILES[0]))
    coarser = Grid(85000.0, 447560.0, 1.0, 60, 80)
    for grid, cells, reference in ((coarser, 20, amersfoort), (LATTICE, 20, amersfoort), (LATTICE, TILE_CELLS, local)):
        with pytest.raises(RunError, match="another lattice"):
            create(store, grid, cells, reference)
    assert create(store, coarser, 20, amersfoort, replace=True)
    grid, read = read_layers(store, coarser, coarser.bounds, ("dsm",))
    assert grid == coarser
    assert np.isnan(read["dsm"]).all()


def test_a_survey_that_grows_in_all_directions_moves_no_chunk(store: str, amersfoort: Reference) -> None:
    write_tile(store, LATTICE, _grid(TILES[0]), _layers(TILES[0]))
    before = {path: digest for path, digest in _digests(store).items() if "/c/" in path}
    wider = Grid(84980.0, 447580.0, CELL, 5 * TILE_CELLS, 6 * TILE_CELLS)
    assert not create(store, LATTICE, TILE_CELLS, amersfoort, extent=wider)
    beyond = Tile(4249, 22374, TILE_M)
    write_tile(store, LATTICE, _grid(beyond), _layers(beyond))
    after = _digests(store)
    assert {path: after[path] for path in before} == before
    dsm = chunked_surface(store)["dsm"]
    assert dsm.rio.bounds() == pytest.approx(wider.bounds)
    for tile in (TILES[0], beyond):
        x_min, y_min, x_max, y_max = tile.bounds
        found = dsm.sel(x=slice(x_min, x_max), y=slice(y_max, y_min)).to_numpy()
        assert np.array_equal(found, _layers(tile)["dsm"], equal_nan=True)
    fresh = f"{store}.fresh"
    create(fresh, LATTICE, TILE_CELLS, amersfoort, extent=wider)
    for tile in (beyond, TILES[0]):
        write_tile(fresh, LATTICE, _grid(tile), _layers(tile))
    assert _digests(fresh) == after


def test_a_window_over_the_edge_of_the_survey_holds_no_data_there(store: str) -> None:
    """What lies there for one survey must not depend on how far another part of it reaches."""
    write_tile(store, LATTICE, _grid(TILES[0]), _layers(TILES[0]))
    grid, found = read_layers(store, LATTICE, (84990.0, 447490.0, 85010.0, 447510.0))
    assert grid == Grid(84990.0, 447510.0, CELL, TILE_CELLS, TILE_CELLS)
    assert np.isnan(found["dsm"][:, :20]).all()
    assert found["holes"][20:].all()
    assert np.array_equal(found["dsm"][:20, 20:], _layers(TILES[0])["dsm"][-20:, :20], equal_nan=True)


def test_a_surface_of_an_earlier_version_says_what_to_do(tmp_path: Path) -> None:
    path = str(tmp_path / "surface.zarr")
    old = zarr.open_group(path, mode="w", zarr_format=3)
    old.create_array("dsm", shape=(80, 80), chunks=(40, 40), dtype="f4", dimension_names=("y", "x"))
    old.attrs.update({"x_min": 85000.0, "y_max": 447560.0, "cell": CELL, "rows": 80, "cols": 80, "chunk_cells": 40})
    zarr.consolidate_metadata(path)
    for reader in (chunked_surface, lambda store: read_layers(store, LATTICE, CITY.bounds)):
        with pytest.raises(RunError, match="earlier version"):
            reader(path)


def test_an_interrupted_creation_is_completed(store: str, amersfoort: Reference) -> None:
    """The driver died after the first arrays; the next one makes the others."""
    before = _digests(store)
    group = zarr.open_group(store, mode="a", use_consolidated=False)
    for name in ("holes", "ndsm"):
        del group[name]
    assert create(store, LATTICE, TILE_CELLS, amersfoort, extent=CITY)
    assert _digests(store) == before


def test_windows_are_cut_at_the_edge() -> None:
    assert window_of(CITY, (84000.0, 447559.0, 85001.0, 448000.0)) == Grid(85000.0, 447560.0, CELL, 2, 2)
    with pytest.raises(ValueError, match="do not meet"):
        window_of(CITY, (0.0, 0.0, 1.0, 1.0))


def _digests(store: str) -> dict[str, str]:
    return {
        str(path.relative_to(store)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(Path(store).rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def s3_endpoint() -> Iterator[str]:
    """An S3 server over HTTP in a process of its own."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    deadline = time.monotonic() + 60
    try:
        while not _answers(f"http://127.0.0.1:{port}"):
            assert time.monotonic() < deadline, "the S3 server did not start"
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        server.kill()
        server.wait()


def _answers(url: str) -> bool:
    try:
        urlopen(url, timeout=1).close()
    except OSError:
        return False
    return True


def test_it_lives_in_an_object_store_too(s3_endpoint: str, tmp_path: Path) -> None:
    import boto3
    from zarr.storage import FsspecStore

    keys = {"key": "test", "secret": "test", "endpoint_url": s3_endpoint}
    client = boto3.client(
        "s3", endpoint_url=s3_endpoint, aws_access_key_id="test", aws_secret_access_key="test", region_name="us-east-1"
    )
    bucket = f"surface-{os.getpid()}"
    client.create_bucket(Bucket=bucket)
    url = f"s3://{bucket}/run/surface.zarr"
    store = FsspecStore.from_url(url, storage_options=keys)
    reference, local_copy = resolve("EPSG:7415"), str(tmp_path / "surface.zarr")
    for target in (store, local_copy):
        assert create(target, LATTICE, TILE_CELLS, reference, extent=CITY)
        assert not create(target, LATTICE, TILE_CELLS, reference, extent=CITY)
        for tile in TILES[:2]:
            write_tile(target, LATTICE, _grid(tile), _layers(tile))
    bounds = (85010.0, 447505.0, 85030.0, 447515.0)
    for name, layer in read_layers(store, LATTICE, bounds)[1].items():
        assert np.array_equal(
            layer, read_layers(local_copy, LATTICE, bounds, (name,))[1][name], equal_nan=layer.dtype.kind == "f"
        )
    city = chunked_surface(FsspecStore.from_url(url, storage_options=keys))
    assert city["dsm"].rio.crs.to_epsg() == 7415
    stored = [o["Key"].removeprefix("run/surface.zarr/") for o in client.list_objects_v2(Bucket=bucket)["Contents"]]
    assert sorted(stored) == sorted(_digests(local_copy))
