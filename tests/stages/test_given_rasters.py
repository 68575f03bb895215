"""A DSM that others have made, with an ortho over it, in the place of points: from the catalog to a building."""

from __future__ import annotations

import json
from pathlib import Path

import geopandas
import numpy as np
import pytest
import rasterio
import shapely

from cityflow.catalog.create import SurveyFiles, create_catalog
from cityflow.core.grid import Grid
from cityflow.errors import CatalogError
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import write_cog
from cityflow.io.rasters.surface_dataset import chunked_surface
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.survey.surface_source import RASTERS, ZARR
from cityflow.survey.survey_parameters import PointsParameters, TileParameters
from in_process import run_all

CELL, GROUND, EAVES = 0.25, 12.0, 17.0
GRID = Grid(90000.0, 460100.0, CELL, 400, 400)
HOUSE = shapely.box(90040.0, 460040.0, 90052.0, 460049.0)


def heights() -> np.ndarray:
    """A flat roof on level ground, and a hole."""
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    dsm = np.where(shapely.contains_xy(HOUSE, x, y), EAVES, GROUND).astype(np.float32)
    dsm[10:20, 10:20] = np.nan
    return dsm


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[tuple[str, str], Record]]:
    """All tasks of a run from rasters, in this process."""
    folder = tmp_path_factory.mktemp("rasters")
    reference = resolve("EPSG:28992")
    (folder / "dsm.tif").write_bytes(write_cog(heights(), GRID, reference))
    red = np.stack([np.full(GRID.shape, v, np.uint8) for v in (180, 60, 50)])
    (folder / "ortho.tif").write_bytes(write_cog(red, GRID, reference, nodata=None))
    geopandas.GeoDataFrame({"id": ["a"]}, geometry=[HOUSE], crs=28992).to_file(folder / "outlines.gpkg")
    create_catalog(
        folder / "catalog",
        SurveyFiles(
            dsm=folder / "dsm.tif", orthos=[folder / "ortho.tif"], outlines=folder / "outlines.gpkg", id_column="id"
        ),
        crs="EPSG:28992",
    )
    catalog = read_catalog(folder / "catalog")
    source = CitySource(catalog, CityParameters(tiles=TileParameters(tile_m=100)))
    assert source.survey.source.kind == RASTERS
    records = run_all(source, Store.open(folder / "run"))
    return folder / "run", records


def test_the_given_heights_are_the_surface(made: tuple[Path, dict[tuple[str, str], Record]]) -> None:
    group = chunked_surface(str(made[0] / ZARR))
    dsm = np.asarray(group["dsm"])
    assert dsm.shape == GRID.shape
    np.testing.assert_allclose(dsm, heights(), atol=1e-4)
    assert np.asarray(group["holes"])[10:20, 10:20].all()
    assert np.abs(np.asarray(group["dtm"]) - GROUND).max() < 0.05


def test_the_given_ortho_is_delivered(made: tuple[Path, dict[tuple[str, str], Record]]) -> None:
    with rasterio.open(next((made[0] / "products" / "ortho").glob("*.tif"))) as ortho:
        assert [int(b[200, 200]) for b in ortho.read()] == [180, 60, 50, 255]


def test_a_building_stands_at_the_height_of_its_roof(made: tuple[Path, dict[tuple[str, str], Record]]) -> None:
    record = made[1]["reconstruct", "a"]
    assert record.status == "done"
    lines = [json.loads(text) for text in (made[0] / "products" / "city.city.jsonl").read_text().splitlines()]
    scale, shift = lines[0]["transform"]["scale"][2], lines[0]["transform"]["translate"][2]
    top = (
        max(v[2] for line in lines[1:] if "a" in line.get("CityObjects", {}) for v in line["vertices"]) * scale + shift
    )
    assert top == pytest.approx(EAVES, abs=0.02)


def test_a_catalog_without_a_dsm_has_no_such_door(made: tuple[Path, dict[tuple[str, str], Record]]) -> None:
    catalog = read_catalog(made[0].parent / "catalog")
    source = CitySource(catalog, CityParameters(points=PointsParameters(source="lidar")))
    with pytest.raises(CatalogError, match="no surface source"):
        list(source.initial())
