from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
import rioxarray
import xarray as xr
from rasterio.crs import CRS
from rasterio.io import MemoryFile
from rasterio.transform import Affine

from cityflow.core.grid import Grid
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import horizontal_transform, resolve
from cityflow.io.rasters.raster import read_window, write_cog, write_vrt

GRID = Grid(85000.0, 447500.0, 0.5, 600, 700)


def _slope(grid: Grid) -> np.ndarray:
    """A plane with a hole of NaN: bilinear interpolation reproduces planes."""
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    return (0.1 * (x - 85000) - 0.05 * (y - 447500) + 3).astype(np.float32)


def test_a_cog_is_one_and_holds_the_array(amersfoort: Reference) -> None:
    array = _slope(GRID)
    array[10:20, 30:50] = np.nan
    data = write_cog(array, GRID, amersfoort)
    with MemoryFile(data) as memory, memory.open() as dataset:
        assert np.array_equal(dataset.read(1), array, equal_nan=True)
        assert dataset.crs == CRS.from_epsg(7415)
        assert dataset.bounds == pytest.approx(GRID.bounds)
        assert np.isnan(dataset.nodata)
        assert dataset.overviews(1) == [2]
        assert dataset.profile["tiled"]
        assert dataset.tags()["VERTICAL_DATUM"] == "NAP height"
        assert dataset.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"


def test_a_compound_without_a_code_of_its_own_keeps_its_vertical_datum() -> None:
    with MemoryFile(write_cog(_slope(GRID), GRID, resolve("EPSG:25833+7837"))) as memory, memory.open() as dataset:
        parts = pyproj.CRS.from_wkt(dataset.crs.to_wkt()).sub_crs_list
    assert [part.to_epsg() for part in parts] == [25833, 7837]


def test_the_same_array_gives_the_same_bytes(amersfoort: Reference) -> None:
    assert write_cog(_slope(GRID), GRID, amersfoort) == write_cog(_slope(GRID), GRID, amersfoort)


def test_masks_and_a_local_frame(local: Reference) -> None:
    mask = np.zeros(GRID.shape, bool)
    mask[3, 4] = True
    with MemoryFile(write_cog(mask, GRID, local)) as memory, memory.open() as dataset:
        assert dataset.crs is None
        assert dataset.nodata is None
        assert dataset.read(1).sum() == dataset.read(1)[3, 4] == 1


@pytest.mark.parametrize("code", ["EPSG:7415", "local"])
def test_a_vrt_over_tiles_is_the_whole(tmp_path: Path, code: str) -> None:
    whole = _slope(GRID)
    parts = []
    for row in range(2):
        for col in range(2):
            part = Grid(85000.0 + col * 175, 447500.0 - row * 150, 0.5, 300, 350)
            path = tmp_path / f"a & {col}_{row}.tif"
            if (row, col) == (1, 1):
                whole[GRID.slices(part)] = np.nan
                continue
            path.write_bytes(write_cog(whole[GRID.slices(part)], part, resolve(code)))
            parts.append((path.name, part))
    (tmp_path / "all.vrt").write_bytes(write_vrt(reversed(parts), resolve(code)))
    assert write_vrt(reversed(parts), resolve(code)) == write_vrt(parts, resolve(code))
    with rasterio.open(tmp_path / "all.vrt") as dataset:
        assert np.array_equal(dataset.read(1), whole, equal_nan=True)
        assert dataset.crs == (CRS.from_epsg(7415) if code != "local" else None)
    opened = rioxarray.open_rasterio(tmp_path / "all.vrt", masked=True)
    assert isinstance(opened, xr.DataArray)
    assert float(opened.mean()) == pytest.approx(float(np.nanmean(whole)), rel=1e-5)


def test_a_vrt_of_nothing_or_of_two_cell_sizes_is_refused(local: Reference) -> None:
    with pytest.raises(ValueError, match="one cell size"):
        write_vrt([], local)
    with pytest.raises(ValueError, match=r"\[0.5, 1.0\]"):
        write_vrt([("a", GRID), ("b", Grid(0, 0, 1.0, 1, 1))], local)


@pytest.mark.parametrize("code", ["EPSG:7415", "local"])
def test_a_window_on_the_same_cells_is_exact(tmp_path: Path, code: str) -> None:
    array = _slope(GRID)
    array[100:110, 100:110] = np.nan
    data = write_cog(array, GRID, resolve(code))
    (tmp_path / "a.tif").write_bytes(data)
    window = Grid(85010.0, 447480.0, 0.5, 200, 300)
    expected = array[GRID.slices(window)]
    for source in (data, tmp_path / "a.tif", str(tmp_path / "a.tif")):
        assert np.array_equal(read_window(source, window, resolve(code)), expected.astype(float), equal_nan=True)


def test_outside_the_raster_is_nan(amersfoort: Reference) -> None:
    window = Grid(84990.0, 447510.0, 0.5, 40, 40)
    read = read_window(write_cog(_slope(GRID), GRID, amersfoort), window, amersfoort)
    assert np.isnan(read[:20]).all()
    assert np.isnan(read[:, :20]).all()
    assert np.array_equal(read[20:, 20:], _slope(GRID)[:20, :20])


def test_coarser_cells_are_averages_and_finer_ones_lie_on_the_plane(amersfoort: Reference) -> None:
    data = write_cog(_slope(GRID), GRID, amersfoort)
    for cell in (0.2, 2.0, 5.0):
        window = Grid(85050.0, 447450.0, cell, 20, 20)
        assert np.allclose(read_window(data, window, amersfoort), _slope(window), atol=2e-4)


def test_noise_is_averaged_when_cells_get_coarser(amersfoort: Reference) -> None:
    rng = np.random.default_rng(7)
    data = write_cog(rng.normal(0, 1, GRID.shape).astype(np.float32), GRID, amersfoort)
    window = Grid(85000.0, 447500.0, 5.0, 60, 70)
    # 100 cells in each: a tenth of the noise is left; bilinear interpolation alone would leave half
    assert read_window(data, window, amersfoort).std() == pytest.approx(0.1, abs=0.01)


def test_another_crs_is_transformed(amersfoort: Reference) -> None:
    """Heights drawn over RD's x and y, stored in UTM, come back where they belong."""
    to_rd = horizontal_transform(resolve("EPSG:25831"), amersfoort)
    x, y = to_rd.transform(85000.0, 447500.0, direction="INVERSE")
    utm = Grid(round(x) - 400.0, round(y) + 400.0, 1.0, 800, 800)
    xs, ys = np.meshgrid(utm.x_centres(), utm.y_centres())
    rd_x, rd_y = to_rd.transform(xs, ys)
    heights = (0.1 * (rd_x - 85000) - 0.05 * (rd_y - 447500) + 3).astype(np.float32)
    window = Grid(84900.0, 447600.0, 0.5, 300, 300)
    read = read_window(write_cog(heights, utm, resolve("EPSG:25831")), window, amersfoort)
    assert np.abs(read - _slope(window)).max() < 1e-3


def test_integers_with_nodata_scale_and_offset(tmp_path: Path, amersfoort: Reference) -> None:
    path = tmp_path / "cm.tif"
    stored = np.full((50, 50), 1234, np.int16)
    stored[:10] = -32768
    with rasterio.open(
        path, "w", driver="GTiff", height=50, width=50, count=1, dtype="int16", nodata=-32768,
        transform=Affine(1, 0, 85000, 0, -1, 447500), crs=CRS.from_epsg(28992),
    ) as dataset:  # fmt: skip
        dataset.write(stored, 1)
        dataset.scales, dataset.offsets = (0.01,), (-2.0,)
    read = read_window(path, Grid(85000.0, 447500.0, 1.0, 50, 50), amersfoort)
    assert np.isnan(read[:10]).all()
    assert np.allclose(read[10:], 10.34)


def test_a_raster_without_nodata_is_nan_outside(tmp_path: Path, amersfoort: Reference) -> None:
    data = write_cog(np.full((10, 10), 7, np.uint8), Grid(85000.0, 447500.0, 1.0, 10, 10), amersfoort)
    read = read_window(data, Grid(84995.0, 447505.0, 1.0, 20, 20), amersfoort)
    assert np.isnan(read[:5]).all()
    assert (read[5:15, 5:15] == 7).all()


def test_a_frame_of_its_own_is_as_good_as_none(tmp_path: Path, local: Reference, amersfoort: Reference) -> None:
    with rasterio.open(
        tmp_path / "a.tif", "w", driver="GTiff", height=50, width=50, count=1, dtype="float32",
        transform=Affine(1, 0, 85000, 0, -1, 447500), crs=CRS.from_wkt('LOCAL_CS["site",UNIT["metre",1]]'),
    ) as dataset:  # fmt: skip
        dataset.write(np.ones((1, 50, 50), np.float32))
    for reference in (local, amersfoort):
        assert (read_window(tmp_path / "a.tif", Grid(85000.0, 447500.0, 1.0, 50, 50), reference) == 1).all()


def test_what_is_no_raster_is_refused(tmp_path: Path, amersfoort: Reference, local: Reference) -> None:
    path = tmp_path / "broken.tif"
    path.write_bytes(b"II*\0 and then nothing")
    with pytest.raises(CatalogError, match=r"broken.tif.*cannot be read as a raster"):
        read_window(path, GRID, amersfoort)
    with pytest.raises(CatalogError, match="local frame"):
        read_window(write_cog(_slope(GRID), GRID, amersfoort), GRID, local)


def test_an_ortho_says_what_its_bands_mean(tmp_path: Path, amersfoort: Reference) -> None:
    grid = Grid(85000.0, 447600.0, 0.5, 40, 60)
    bands = np.random.default_rng(4).integers(0, 256, (4, 40, 60)).astype(np.uint8)
    (tmp_path / "a.tif").write_bytes(write_cog(bands, grid, amersfoort))
    (tmp_path / "all.vrt").write_bytes(write_vrt([("a.tif", grid)], amersfoort, "uint8", None, bands=4))
    for name in ("a.tif", "all.vrt"):
        with rasterio.open(tmp_path / name) as dataset:
            assert [c.name for c in dataset.colorinterp] == ["red", "green", "blue", "alpha"]
            np.testing.assert_array_equal(dataset.read(), bands)
            assert dataset.crs == CRS.from_epsg(28992), "colours have no heights"
            assert dataset.units == (None,) * 4
            assert "VERTICAL_DATUM" not in dataset.tags()


def test_a_large_vrt_has_overviews_made_of_those_of_its_tiles(tmp_path: Path, amersfoort: Reference) -> None:
    grids = [Grid(85000.0 + 600 * i, 447600.0, 1.0, 600, 600) for i in range(4)]
    for i, grid in enumerate(grids):
        (tmp_path / f"{i}.tif").write_bytes(write_cog(np.full(grid.shape, float(i), np.float32), grid, amersfoort))
    (tmp_path / "all.vrt").write_bytes(write_vrt([(f"{i}.tif", g) for i, g in enumerate(grids)], amersfoort))
    with rasterio.open(tmp_path / "all.vrt") as dataset:
        assert dataset.overviews(1) == [2, 4, 8]
        assert dataset.read(1, out_shape=(75, 300))[37, [37, 112, 187, 262]].tolist() == [0.0, 1.0, 2.0, 3.0]
