"""Textures through the stages: an ortho colours roofs, walls stay plain with their reason, pages belong to leaves, and no order changes a byte."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path

import cv2
import geopandas
import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from cityflow.catalog.create import SurveyFiles, create_catalog
from cityflow.core.building import Lod
from cityflow.core.grid import Grid
from cityflow.core.texture import FIRST_IMAGE
from cityflow.flow.stage import Node
from cityflow.flow.store import Store
from cityflow.flow.task import Json
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.city_models.cityjson import Transform, read_feature
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import write_cog
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.settings import load_workflow
from in_process import Records, run_all

X, Y, GROUND, TOP = 90000.0, 460000.0, 3.0, 12.0
HOUSES = {
    "a": (shapely.box(X + 20, Y + 20, X + 32, Y + 30), (200, 60, 40)),
    "b": (shapely.box(X + 32, Y + 20, X + 44, Y + 30), (60, 80, 200)),
    "far": (shapely.box(X + 150, Y + 150, X + 162, Y + 160), (90, 160, 70)),
}
"""A row of two, and one in another atlas cell; each with the colour of its flat roof."""
SIDE = 200
WORKFLOW = Path(__file__).parents[2] / "workflows" / "ortho_city.yaml"


def _ortho(hole: bool = False) -> tuple[np.ndarray, Grid]:
    grid = Grid(X, Y + SIDE, 0.25, SIDE * 4, SIDE * 4)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    colours = np.full((3, *grid.shape), 110.0)
    for plan, colour in HOUSES.values():
        on = shapely.contains_xy(plan, x, y)
        colours[:, on] = np.array(colour, float)[:, None]
    colours += np.random.default_rng(3).normal(0, 1.5, colours.shape)
    if hole:
        colours[:, (x > X + 145) & (y > Y + 145)] = np.nan
    return colours, grid


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made, rd = tmp_path_factory.mktemp("painted"), resolve("EPSG:28992")
    grid = Grid(X, Y + SIDE, 0.5, SIDE * 2, SIDE * 2)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    z = np.full(grid.shape, GROUND)
    z[shapely.contains_xy(shapely.union_all([h[0] for h in HOUSES.values()]), x, y)] = TOP
    (made / "dsm.tif").write_bytes(write_cog(z.astype(np.float32), grid, rd))
    colours, fine = _ortho()
    (made / "ortho.tif").write_bytes(write_cog(np.clip(colours, 1, 255).astype(np.uint8), fine, rd, nodata=None))
    outlines = geopandas.GeoDataFrame({"id": list(HOUSES)}, geometry=[h[0] for h in HOUSES.values()], crs=28992)
    outlines.to_file(made / "outlines.gpkg")
    create_catalog(
        made / "catalog",
        SurveyFiles(dsm=made / "dsm.tif", orthos=[made / "ortho.tif"], outlines=made / "outlines.gpkg", id_column="id"),
        crs="EPSG:28992",
    )
    return made


def _source(folder: Path, *settings: str, overrides: Mapping[Node, Mapping[str, Json]] | None = None) -> CitySource:
    parameters = load_workflow(WORKFLOW, ["tiles.tile_m=200", "atlas.cell_m=100", *settings]).city
    return CitySource(read_catalog(folder / "catalog"), parameters, overrides=overrides)


@pytest.fixture(scope="module")
def run(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Records]:
    where = tmp_path_factory.mktemp("run")
    return where, run_all(_source(folder), Store.open(where))


def _picture(path: Path) -> NDArray[np.generic]:
    found = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert found is not None
    return found


def _features(run: Path) -> list[dict]:  # type: ignore[type-arg]
    return [json.loads(line) for line in (run / "products" / "city.city.jsonl").read_text().splitlines()[1:]]


def test_every_unit_is_textured_and_its_leaf_has_pages(run: tuple[Path, Records]) -> None:
    where, records = run
    assert {u for s, u in records if s == "texture"} == set(HOUSES)
    assert all(records["texture", u].status == "done" for u in HOUSES)
    atlas_cells = sorted(u for s, u in records if s == "atlas")
    assert len(atlas_cells) == 2, "a and b share an atlas cell"
    for atlas_cell in atlas_cells:
        page = _picture(where / f"products/textures/{atlas_cell}.rectified.0.jpg")
        index = _picture(where / f"products/textures/{atlas_cell}.rectified.0.index.png")
        names = json.loads((where / f"products/textures/{atlas_cell}.images.json").read_text())
        assert page.shape[:2] == index.shape
        assert set(np.unique(index)) <= {0, 1, FIRST_IMAGE}
        assert names[str(FIRST_IMAGE)] == "ortho"


def test_roofs_have_the_colours_of_the_ortho_and_walls_say_why_they_have_none(run: tuple[Path, Records]) -> None:
    where, _ = run
    for feature in _features(where):
        name = feature["id"]
        if name not in HOUSES:
            continue
        look = feature["appearance"]
        solid = next(g for g in feature["CityObjects"][name]["geometry"] if g["lod"] == Lod.LOD22)
        rings = solid["texture"]["photographs"]["values"][0]
        kinds = [solid["semantics"]["surfaces"][k]["type"] for k in solid["semantics"]["values"][0]]
        roofs = [ring for ring, kind in zip(rings, kinds, strict=True) if kind == "RoofSurface"]
        assert roofs
        assert all(ring[0][0] is not None for ring in roofs)
        assert all(ring[0][0] is None for ring, kind in zip(rings, kinds, strict=True) if kind != "RoofSurface")
        page, *corners = roofs[0][0]
        picture = _picture(where / "products" / look["textures"][page]["image"])[..., ::-1]
        u, v = np.mean([look["vertices-texture"][k] for k in corners], axis=0)
        seen = picture[int((1 - v) * picture.shape[0]), int(u * picture.shape[1])].astype(float)
        assert np.abs(seen - HOUSES[name][1]).max() < 12
        attributes = feature["CityObjects"][name]["attributes"]
        assert attributes["texture_gsd_m"] == pytest.approx(0.25, abs=0.01)
        reasons = {s.get("texture_missing") for s in solid["semantics"]["surfaces"] if s["type"] == "WallSurface"}
        assert any(r and "image" in r for r in reasons)


def test_no_order_of_tasks_changes_a_byte(folder: Path, run: tuple[Path, Records], tmp_path: Path) -> None:
    where, records = run
    rng = np.random.default_rng(1)
    again = run_all(_source(folder), Store.open(tmp_path), lambda ready: int(rng.integers(len(ready))))
    assert {k: r.outputs for k, r in again.items()} == {k: r.outputs for k, r in records.items()}
    pages = sorted(p.name for p in (where / "products/textures").iterdir())
    assert [(tmp_path / "products/textures" / p).read_bytes() for p in pages] == [
        (where / "products/textures" / p).read_bytes() for p in pages
    ]


def test_only_the_leaf_of_a_unit_depends_on_its_texture(
    folder: Path, run: tuple[Path, Records], tmp_path: Path
) -> None:
    where, records = run
    overrides = {("texture", "far"): {"patches": {"padding_px": 5}}}
    shutil.copytree(where, tmp_path / "run")
    changed = run_all(_source(folder, overrides=overrides), Store.open(tmp_path / "run"), known=records)
    differ = {k for k in records if changed[k].digest != records[k].digest}
    assert {s for s, _ in differ} == {"texture", "atlas", "export"}, "an ortho alone asks for no windows"
    assert len([k for k in differ if k[0] == "atlas"]) == 1
    assert [k for k in differ if k[0] == "texture"] == [("texture", "far")]


def test_an_ortho_that_ends_within_a_unit_leaves_it_plain(folder: Path, tmp_path: Path) -> None:
    colours, grid = _ortho(hole=True)
    data = np.where(np.isfinite(colours), np.clip(colours, 1, 255), 0).astype(np.uint8)
    (tmp_path / "ortho.tif").write_bytes(write_cog(data, grid, resolve("EPSG:28992"), nodata=0))
    create_catalog(
        tmp_path / "catalog",
        SurveyFiles(
            dsm=folder / "dsm.tif", orthos=[tmp_path / "ortho.tif"], outlines=folder / "outlines.gpkg", id_column="id"
        ),
        crs="EPSG:28992",
    )
    records = run_all(_source(tmp_path), Store.open(tmp_path / "run"))
    assert records["texture", "far"].result["textured"] == 0
    assert records["texture", "a"].result["textured"] > 0


def test_nobody_wants_textures(folder: Path, run: tuple[Path, Records], tmp_path: Path) -> None:
    where, known = run
    plain = Path(shutil.copytree(where, tmp_path / "run"))
    shutil.rmtree(plain / "products/textures")
    records = run_all(_source(folder, "texture.when=never"), Store.open(plain), known=known)
    assert not {s for s, _ in records} & {"texture", "atlas", "windows"}
    assert not (plain / "products/textures").exists()
    assert all("appearance" not in f for f in _features(plain))


def test_textured_features_are_read_again(run: tuple[Path, Records]) -> None:
    lines = (run[0] / "products" / "city.city.jsonl").read_bytes().splitlines()
    transform = Transform.of_header(json.loads(lines[0]))
    read = {b.id for b in (read_feature(line, transform) for line in lines[1:] if b'"Building"' in line)}
    assert read == set(HOUSES)
