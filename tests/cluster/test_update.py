"""A RUN takes new catalogs: what is concerned runs, nothing else, and the buildings that have changed are told, no others."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import geopandas
import numpy as np
import pytest
import shapely
import yaml

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import write_cog
from cityflow.runs.current import current_records
from cityflow.runs.run_folder import open_run
from cityflow.workflow.former_state import State, Update, begin_update, data_of, last_update, note_update
from cityflow.workflow.run import failed_tasks
from cluster.second_epoch import CORRECTED, GONE, NEW, NEW_HEIGHT_M, NEW_PLACE, RAISED, RAISED_M, second_epoch
from cluster.small_city import (
    SCENE,
    Commands,
    Done,
    SmallCity,
    contents,
    laz,
    lidar_files,
    make_city,
    newest,
    redone,
    scene,
    split,
)

pytestmark = pytest.mark.cluster

BEYOND = "beyond.laz"
SHIFT = np.array([-250.0, -170.0, 0.0])
"""Moves the bounding box of the survey west and south, by more than a tile and what a tile looks at around it."""


def beyond() -> PointCloud:
    """Points of a corner, once more south-west of the town."""
    points = scene().points
    part = points.take((points.xyz[:, 0] < SCENE.origin_x + 30) & (points.xyz[:, 1] < SCENE.origin_y + 30))
    return PointCloud(part.xyz + SHIFT, part.classification, part.return_number, part.number_of_returns)


def changes(run: Path, number: int) -> dict[str, Any]:
    return dict(json.loads((run / f"updates/{number}/changes.json").read_text()))


def test_new_lidar_at_the_edge_leaves_the_rest_fresh(cityflow: Commands, copied_run: Path, tmp_path: Path) -> None:
    """The fresh tiles keep their records, their chunks and their products, byte for byte."""
    city = make_city(tmp_path / "town", described=False)
    city.lidar(BEYOND).write_bytes(laz(beyond()))
    city.describe()
    surfaces, before = newest(copied_run, "surface"), contents(copied_run)
    done: list[Any] = []
    ran = redone(copied_run, lambda: done.append(cityflow("update", copied_run, "--catalog", city.catalog)))
    assert done[0].code == 0, done[0].text
    made = newest(copied_run, "surface").keys() - surfaces.keys()
    assert len(made) == 1
    assert {unit for stage, unit in ran if stage == "surface"} == made
    assert {unit for stage, unit in ran if stage == "export"} == made | {"city"}
    # given outlines are dealt out to all tiles at once, and tiles take them from there: the same as before
    assert {stage for stage, unit in ran if unit not in made} <= {"ingest", "outline", "export"}
    after = contents(copied_run)
    moved = {path for path in before if after.get(path) != before[path]}
    whole = {"products/catalog.json", "products/collection.json", "products/city.city.jsonl", "products/outlines.gpkg"}
    assert {p for p in moved - whole if not p.endswith((".vrt", "zarr.json", "city.json"))} == set()
    assert changes(copied_run, 1)["changes"] == []


def epoch_2(folder: Path, seed: int = 7) -> tuple[SmallCity, float]:
    epoch = second_epoch(seed)
    city = make_city(folder, list(epoch.outlines.items()), described=False)
    for name, part in split(epoch.points).items():
        city.lidar(name).write_bytes(laz(part))
    city.describe()
    return city, epoch.cut_m2


def test_exactly_the_changed_buildings_are_listed_also_when_the_driver_died_and_tasks_failed(
    cityflow: Commands, small_city: SmallCity, copied_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    city, cut_m2 = epoch_2(tmp_path / "later")
    with monkeypatch.context() as patch:
        patch.setattr("cityflow.workflow.run.remove_stale_products", _dies)
        assert cityflow("update", copied_run, "--catalog", city.catalog).code != 0
    assert not (copied_run / "updates/1/changes.json").exists()
    done = cityflow("update", copied_run, "--catalog", city.catalog)
    assert done.code == 0, done.text
    assert "1 new, 1 gone, 2 altered" in done.out
    assert not (copied_run / "updates/2").exists()
    assert "changes.html" in (copied_run / "report.html").read_text()
    tree = changes(copied_run, 1)
    found = {(c["kind"], c["id"] or c["before"]): c for c in tree["changes"]}
    assert found.keys() == {("new", NEW), ("gone", GONE), ("altered", RAISED), ("altered", CORRECTED)}
    assert tree["compared"] + tree["untouched"] == len(scene().outlines) - 3
    raised, cut, new = found["altered", RAISED], found["altered", CORRECTED], found["new", NEW]
    area = scene().outlines[RAISED].area
    for name in ("ridge_m", "eaves_m", "roof_mean_m", "roof_rms_m"):
        assert raised[name] == pytest.approx(RAISED_M, abs=0.05)
    assert raised["volume_m3"] == pytest.approx(RAISED_M * area, rel=0.02)
    assert raised["significance"] > 10
    assert cut["area_m2"] == pytest.approx(-cut_m2, abs=0.05)
    assert cut["outline_changed_m2"] == pytest.approx(cut_m2, abs=0.5)
    assert abs(cut["roof_mean_m"]) < 0.05
    # the floor is level, at the lowest ground
    assert new["volume_m3"] == pytest.approx(NEW_HEIGHT_M * NEW_PLACE.area, rel=0.1)
    layer = geopandas.read_file(copied_run / "updates/1/changes.gpkg", layer="changes", engine="pyogrio")
    assert dict(zip(layer["id"], layer["kind"], strict=True)) == {
        NEW: "new",
        "": "gone",
        CORRECTED: "altered",
        RAISED: "altered",
    }
    assert layer.crs.to_epsg() == 28992
    page = (copied_run / "updates/1/changes.html").read_text()
    assert page.count("data:image/jpeg") == 3 * len(found)

    again = cityflow("update", copied_run, "--catalog", city.catalog, "--set", "changes.least_height_m=4")
    assert again.code == 0, again.text
    assert {c["id"] or c["before"] for c in changes(copied_run, 1)["changes"]} == {NEW, GONE, CORRECTED}
    assert not (copied_run / "updates/2").exists()

    first = make_city(tmp_path / "first again")
    with hidden(first.outlines):
        assert_nobody_is_called_gone(cityflow("update", copied_run, "--catalog", first.catalog), copied_run)
    assert cityflow("rerun", copied_run, "--failed").code == 0
    assert_the_next_starts_from_what_is_healed(copied_run, read_catalog(str(city.catalog)))
    back = cityflow("update", copied_run, "--catalog", first.catalog, "--set", "changes.least_height_m=0.5")
    assert back.code == 0, back.text
    kinds = {(c["kind"], c["id"] or c["before"]) for c in changes(copied_run, 2)["changes"]}
    assert kinds == {("gone", NEW), ("new", GONE), ("altered", RAISED), ("altered", CORRECTED)}
    report = (copied_run / "report.html").read_text()
    assert report.index("updates/2/changes.html") < report.index("updates/1/changes.html")


@contextmanager
def hidden(path: Path) -> Iterator[None]:
    data = path.read_bytes()
    path.unlink()
    try:
        yield
    finally:
        path.write_bytes(data)


def assert_nobody_is_called_gone(failed: Done, run: Path) -> None:
    """Without outlines nobody knows which buildings stand."""
    assert failed.code == 1
    assert "the city is incomplete" in failed.err
    tree = changes(run, 2)
    assert tree["changes"] == []
    assert set(tree["unclear"]) == (scene().outlines.keys() | {NEW}) - {GONE}
    assert tree["failed"][0].startswith("ingest-outlines: ")
    page = (run / "updates/2/changes.html").read_text()
    assert "This comparison is incomplete" in page
    assert f"cityflow rerun {run} --failed" in page
    assert cast(Update, last_update(Store.open(run))).state is State.FAILED


def assert_the_next_starts_from_what_is_healed(path: Path, other: Catalog) -> None:
    """And goes on from the state before as long as failures are there."""
    run = open_run(str(path))
    ended, new = cast(Update, last_update(run.store)), replace(run, catalog=other)
    with Ledger.open(run.store) as ledger:
        records = current_records(run, ledger)
        assert failed_tasks(records) == []
        third = begin_update(run, records, new, is_whole=True)
        assert (third.number, third.former_data) == (3, data_of(run.catalog))
        run.store.remove(third.folder)
        second = begin_update(run, records, new, is_whole=False)
        assert (second.number, second.former_data) == (2, ended.former_data)
    note_update(run.store, ended)


def _dies(*_: object) -> None:
    raise KeyboardInterrupt


def test_a_catalog_that_does_not_continue_the_survey_is_refused(
    cityflow: Commands, copied_run: Path, tmp_path: Path
) -> None:
    """In a line, and nothing is written."""
    before = contents(copied_run, ("products", "records", "run.json", "updates"))
    west = make_city(tmp_path / "west", described=False)
    for name in lidar_files():
        points = scene().points
        west.lidar(name).write_bytes(laz(points.take(points.xyz[:, 0] < SCENE.origin_x + 40)))
    west.describe()
    refused = cityflow("update", copied_run, "--catalog", west.catalog)
    assert refused.code == 1
    assert "the new catalog has nothing over" in refused.err
    shutil.copytree(west.catalog, tmp_path / "other")
    path = tmp_path / "other" / "collection.json"
    path.write_text(path.read_text().replace("EPSG:7415", "EPSG:28992"))
    refused = cityflow("update", copied_run, "--catalog", path.parent, "--allow-outside")
    assert refused.code == 1
    assert len(refused.err.strip().splitlines()) <= 2
    refused = cityflow("update", copied_run, "--catalog", west.catalog, "--set", "surface.cell_m=1")
    assert "no parameter of the comparison" in refused.err
    assert contents(copied_run, ("products", "records", "run.json", "updates")) == before


GRID = Grid(90000.0, 460050.0, 0.25, 200, 400)
PLACES = {f"h{k}": shapely.box(90010.0 + 22 * k, 460015.0, 90022.0 + 22 * k, 460027.0) for k in range(4)}
GROUND_M, EAVES_M, HIGHER_M = 12.0, 17.0, 2.5


@dataclass(frozen=True)
class GivenHeights:
    """A survey of a DSM and outlines, with its workflow."""

    folder: Path
    catalog: Path
    workflow: Path


def given_heights(folder: Path, tops: Mapping[str, float]) -> GivenHeights:
    """Flat roofs on level ground, with noise of 1 cm."""
    folder.mkdir()
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    dsm = np.random.default_rng(5).normal(GROUND_M, 0.01, GRID.shape)
    for name, top in tops.items():
        dsm[shapely.contains_xy(PLACES[name], x, y)] += top - GROUND_M
    (folder / "dsm.tif").write_bytes(write_cog(dsm.astype(np.float32), GRID, resolve("EPSG:28992")))
    shapes = [PLACES[name] for name in tops]
    geopandas.GeoDataFrame({"id": list(tops)}, geometry=shapes, crs=28992).to_file(folder / "outlines.gpkg")
    create_catalog(
        folder / "catalog",
        SurveyFiles(dsm=folder / "dsm.tif", outlines=folder / "outlines.gpkg", id_column="id"),
        crs="EPSG:28992",
        text=SurveyText(title="Given heights"),
    )
    workflow = {
        "name": "given_heights",
        "points": {"source": "rasters"},
        "tiles": {"tile_m": 100},
        "export": {"formats": ["cityjson"]},
    }
    (folder / "workflow.yaml").write_text(yaml.safe_dump(workflow))
    return GivenHeights(folder, folder / "catalog", folder / "workflow.yaml")


def test_another_dsm_tells_the_raised_the_new_and_the_gone(cityflow: Commands, tmp_path: Path) -> None:
    first = given_heights(tmp_path / "first", {"h0": EAVES_M, "h1": EAVES_M, "h2": EAVES_M})
    then = given_heights(tmp_path / "then", {"h0": EAVES_M, "h1": EAVES_M + HIGHER_M, "h3": EAVES_M})
    cityflow.run(first, tmp_path / "run")
    done = cityflow("update", tmp_path / "run", "--catalog", then.catalog)
    assert done.code == 0, done.text
    tree = changes(tmp_path / "run", 1)
    found = {(c["kind"], c["id"] or c["before"]): c for c in tree["changes"]}
    assert found.keys() == {("new", "h3"), ("gone", "h2"), ("altered", "h1")}
    assert tree["compared"] + tree["untouched"] == 1
    assert found["altered", "h1"]["roof_mean_m"] == pytest.approx(HIGHER_M, abs=0.05)
    assert found["altered", "h1"]["volume_m3"] == pytest.approx(HIGHER_M * PLACES["h1"].area, rel=0.02)
