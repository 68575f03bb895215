"""Rasters and outlines only: a coarse DSM, an orthophoto and a cadastre become roofs of the right type; an edit sets another."""

from __future__ import annotations

import shutil
from pathlib import Path

import geopandas
import numpy as np
import pytest
import shapely
from shapely import Point, affinity

from cityflow.catalog.check import check_catalog
from cityflow.catalog.create import SurveyFiles, create_catalog
from cityflow.catalog.findings import Level
from cityflow.core.grid import Grid
from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import write_cog
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.settings import load_workflow
from in_process import Records, run_all

X, Y, GROUND = 90000.0, 460000.0, 3.0
LENGTH_M, DEPTH_M, EAVES_M, SLOPE = 14.0, 9.0, 6.0, 0.8
TURNS_DEG = {"gable": 12.0, "flat": 40.0}
MIDDLES = {"gable": (X + 30.0, Y + 40.0), "flat": (X + 70.0, Y + 60.0)}
WORKFLOW = Path(__file__).parents[2] / "workflows" / "ortho_city.yaml"


def _outline(kind: str) -> shapely.Polygon:
    box = shapely.box(-LENGTH_M / 2, -DEPTH_M / 2, LENGTH_M / 2, DEPTH_M / 2)
    return affinity.translate(affinity.rotate(box, TURNS_DEG[kind], origin=(0, 0)), *MIDDLES[kind])


def _places(grid: Grid, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """(rows, cols) across the house, and whether a cell is on it."""
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    turn = np.radians(TURNS_DEG[kind])
    across = -(x - MIDDLES[kind][0]) * np.sin(turn) + (y - MIDDLES[kind][1]) * np.cos(turn)
    return across, shapely.contains_xy(_outline(kind), x, y)


def _dsm(rng: np.random.Generator) -> tuple[np.ndarray, Grid]:
    """Cells of 1 m, each the mean of what is in it, with errors of 15 cm."""
    fine = Grid(X, Y + 100, 0.25, 400, 400)
    z = np.full(fine.shape, GROUND)
    across, on = _places(fine, "gable")
    z[on] = (GROUND + EAVES_M + SLOPE * (DEPTH_M / 2 - np.abs(across)))[on]
    z[_places(fine, "flat")[1]] = GROUND + 8.0
    coarse = z.reshape(100, 4, 100, 4).mean(axis=(1, 3))
    return (coarse + rng.normal(0, 0.15, coarse.shape)).astype(np.float32), Grid(X, Y + 100, 1.0, 100, 100)


def _ortho(rng: np.random.Generator) -> tuple[np.ndarray, Grid]:
    """One side of the roof in the sun, the other not."""
    grid = Grid(X, Y + 100, 0.25, 400, 400)
    grey = np.full(grid.shape, 110.0)
    across, on = _places(grid, "gable")
    grey[on] = np.where(across > 0, 95.0, 170.0)[on]
    grey[_places(grid, "flat")[1]] = 150.0
    grey += rng.normal(0, 3, grid.shape)
    return np.clip(np.stack([grey, grey * 0.9, grey * 0.8]), 0, 255).astype(np.uint8), grid


@pytest.fixture(scope="module")
def catalog(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, rng, rd = tmp_path_factory.mktemp("ortho"), np.random.default_rng(5), resolve("EPSG:28992")
    (folder / "dsm.tif").write_bytes(write_cog(*_dsm(rng), rd))
    colours, grid = _ortho(rng)
    (folder / "2024.tif").write_bytes(write_cog(colours, grid, rd, nodata=None))
    grey = _ortho(rng)[0][:1].astype(np.uint16) * 200
    (folder / "2021.tif").write_bytes(write_cog(grey, grid, rd, nodata=None))
    outlines = geopandas.GeoDataFrame({"id": list(MIDDLES)}, geometry=[_outline(k) for k in MIDDLES], crs=28992)
    outlines.to_file(folder / "outlines.gpkg")
    create_catalog(
        folder / "catalog",
        SurveyFiles(
            dsm=folder / "dsm.tif",
            orthos=[folder / "2024.tif", folder / "2021.tif"],
            outlines=folder / "outlines.gpkg",
            id_column="id",
        ),
        crs="EPSG:28992",
    )
    edit = geopandas.GeoDataFrame({"roof_type": ["hip"]}, geometry=[Point(MIDDLES["gable"])], crs=28992)
    edit.to_file(folder / "edits.gpkg", layer="roof_types")
    return folder / "catalog"


def _records(catalog: Path, run: Path, settings: list[str], known: tuple[Path, Records] | None = None) -> Records:
    """All tasks of a run of the shipped workflow but its textures, in this process; of those in `known` what differs."""
    if known is not None:
        shutil.copytree(known[0], run)
    parameters = load_workflow(WORKFLOW, ["tiles.tile_m=100", "texture.when=never", *settings]).city
    return run_all(CitySource(read_catalog(catalog), parameters), Store.open(run), known=known and known[1])


@pytest.fixture(scope="module")
def plain(catalog: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Records]:
    """A run without edits."""
    run = tmp_path_factory.mktemp("plain") / "run"
    return run, _records(catalog, run, [])


def test_a_coarse_surface_and_an_ortho_make_roofs_and_an_edit_another(
    catalog: Path, plain: tuple[Path, Records], tmp_path: Path
) -> None:
    found = plain[1]
    gable, flat = (found["reconstruct", k] for k in ("gable", "flat"))
    assert (gable.status, gable.result["method"], gable.result["roof_type"]) == ("done", "roof_types", "gable")
    assert (flat.status, flat.result["roof_type"]) == ("done", "flat")
    ridge = GROUND + EAVES_M + SLOPE * DEPTH_M / 2
    assert gable.result["ridge_height_m"] == pytest.approx(ridge, abs=0.3)
    assert {"ortho", "ortho-2"} <= set(gable.inputs)
    edited = _records(catalog, tmp_path / "edited", [f"edits.path={catalog.parent / 'edits.gpkg'}"], plain)
    assert edited["reconstruct", "gable"].result["roof_type"] == "hip"
    assert edited["reconstruct", "flat"].digest == flat.digest


def test_a_roof_type_that_does_not_fit_is_said(catalog: Path, plain: tuple[Path, Records], tmp_path: Path) -> None:
    edit = geopandas.GeoDataFrame({"roof_type": ["cone"]}, geometry=[Point(MIDDLES["gable"])], crs=28992)
    edit.to_file(tmp_path / "edits.gpkg", layer="roof_types")
    edited = _records(catalog, tmp_path / "run", [f"edits.path={tmp_path / 'edits.gpkg'}"], plain)
    found = edited["reconstruct", "gable"]
    assert (found.status, found.result["roof_type"]) == ("degraded", "gable")
    assert "an edit sets the roof type 'cone'" in found.reason


def test_a_grey_ortho_of_sixteen_bits_alone_will_do(catalog: Path, tmp_path: Path) -> None:
    folder = catalog.parent
    create_catalog(
        tmp_path / "grey",
        SurveyFiles(
            dsm=folder / "dsm.tif", orthos=[folder / "2021.tif"], outlines=folder / "outlines.gpkg", id_column="id"
        ),
        crs="EPSG:28992",
    )
    found = _records(tmp_path / "grey", tmp_path / "run", [])
    assert found["reconstruct", "gable"].result["roof_type"] == "gable"
    assert not [f for f in check_catalog(tmp_path / "grey").findings if f.level is Level.ERROR]
