"""``cityflow raster`` on surfaces as a run leaves them."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import rasterio
from distributed import LocalCluster
from rich.console import Console

from cityflow.cli.rasters import raster
from cityflow.core.grid import Grid
from cityflow.core.reference import Reference
from cityflow.errors import RunError
from cityflow.flow.lazy_arrays import computing
from cityflow.flow.store import Store
from cityflow.io.crs import resolve
from cityflow.io.rasters.surface_dataset import chunked_surface
from cityflow.io.rasters.surface_zarr import create, write_tile
from cityflow.workflow.city_raster import RasterRequest, write_city_raster

CELL, TILE = 0.5, 20
RD = resolve("EPSG:7415")


def run_with_surface(folder: Path, reference: Reference, left: float, tiles: int, height: float) -> str:
    """A RUN's surface of one row of tiles, of one height, the last tile never written."""
    store = Store.open(folder)
    grid = Grid(left, 447000.0, CELL, TILE, tiles * TILE)
    create(store.zarr_store("surface.zarr"), grid, TILE, reference)
    for k in range(tiles - 1):
        tile = Grid(left + k * TILE * CELL, 447000.0, CELL, TILE, TILE)
        write_tile(store.zarr_store("surface.zarr"), grid, tile, {"dsm": np.full(tile.shape, height + k, np.float32)})
    return str(folder)


def test_heights_on_coarser_cells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = run_with_surface(tmp_path / "a", RD, 85000.0, 3, 10.0)
    file = tmp_path / "dsm.tif"
    for name in (file, tmp_path / "again.tif"):
        write_city_raster(run, name, RasterRequest("dsm", 2.0), "", 1, Console(), in_json=True)
    told = json.loads(capsys.readouterr().out.split("}\n{")[0].rstrip("}\n") + "}")
    assert told["cells"] == [5, 15]
    assert told["known_share"] == pytest.approx(2 / 3, abs=1e-3)
    assert (told["lowest_m"], told["highest_m"]) == (10.0, 11.0)
    with rasterio.open(file) as made:
        assert made.crs.to_epsg() == 7415
        assert made.bounds == (85000.0, 446990.0, 85030.0, 447000.0)
        assert np.isnan(made.nodata)
        values = made.read(1)
    assert values[:, :5].tolist() == [[10.0] * 5] * 5
    assert np.isnan(values[:, 10:]).all()
    assert file.read_bytes() == (tmp_path / "again.tif").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "again.tif", "dsm.tif"]


def test_a_relief_says_nothing_where_nothing_is_known(tmp_path: Path) -> None:
    run = run_with_surface(tmp_path / "a", RD, 85000.0, 2, 10.0)
    write_city_raster(run, tmp_path / "r.tif", RasterRequest(relief=True), "", 1, Console(quiet=True))
    with rasterio.open(tmp_path / "r.tif") as made:
        grey = made.read(1)
        assert (made.dtypes, made.nodata, made.crs.to_epsg()) == (("uint8",), 0.0, 28992)
    assert (grey[:, :TILE] > 0).all()
    assert (grey[:, TILE:] == 0).all()


def test_the_difference_of_two_runs(tmp_path: Path) -> None:
    now = run_with_surface(tmp_path / "now", RD, 85000.0, 4, 12.0)
    before = run_with_surface(tmp_path / "before", RD, 85010.0, 4, 10.0)
    write_city_raster(now, tmp_path / "d.tif", RasterRequest(minus=before), "", 1, Console(quiet=True))
    with rasterio.open(tmp_path / "d.tif") as made:
        assert made.bounds.left == 85010.0
        values = made.read(1)
    assert values.shape == (TILE, 3 * TILE)
    assert np.unique(values[:, : 2 * TILE]).tolist() == [3.0]
    assert np.isnan(values[:, 2 * TILE :]).all()


def test_only_heights_state_a_vertical_datum(tmp_path: Path) -> None:
    run = run_with_surface(tmp_path / "a", RD, 85000.0, 2, 10.0)
    for request, epsg in ((RasterRequest(), 7415), (RasterRequest("ndsm"), 28992), (RasterRequest(minus=run), 28992)):
        write_city_raster(run, tmp_path / "r.tif", request, "", 1, Console(quiet=True))
        with rasterio.open(tmp_path / "r.tif") as made:
            assert made.crs.to_epsg() == epsg
            assert ("VERTICAL_DATUM" in made.tags()) == (epsg == 7415)


def test_what_does_not_fit_is_named(tmp_path: Path) -> None:
    run = run_with_surface(tmp_path / "a", RD, 85000.0, 2, 10.0)
    for request, match in (
        (RasterRequest(cell_m=0.7), r"cells of 0\.7 m do not fit .* choose --cell from 0\.5, 1, 2, 2\.5, 5, 10"),
        (RasterRequest(minus=str(tmp_path)), r"no run here"),
    ):
        with pytest.raises(RunError, match=match):
            write_city_raster(run, tmp_path / "r.tif", request, "", 1, Console())
    assert not (tmp_path / "r.tif").exists()


def test_a_file_that_is_no_geotiff_is_refused_at_once(tmp_path: Path) -> None:
    run = run_with_surface(tmp_path / "a", RD, 85000.0, 2, 10.0)
    (tmp_path / "a" / "run.json").write_text("{}")
    for out, problem in (
        (tmp_path / "a.png", "no such format → end the name of the file in .tif or .tiff"),
        (tmp_path, "no name"),
        (tmp_path / "b" / "r.tif", "no such folder"),
        (Path("/proc/r.tif"), "cannot write here"),
    ):
        with pytest.raises(RunError, match=problem):
            raster(run, out)


def test_a_cluster_computes_the_same(tmp_path: Path) -> None:
    run = run_with_surface(tmp_path / "a", RD, 85000.0, 3, 10.0)
    heights = chunked_surface(Store.open(run).zarr_store("surface.zarr"))["dsm"]
    with (
        LocalCluster(n_workers=1, processes=False, protocol="tcp", dashboard_address=None) as cluster,
        computing() as here,
        computing(cluster.scheduler_address) as there,
    ):
        np.testing.assert_array_equal(here(heights).values, there(heights).values)
