"""A RUN takes new catalogs: what is concerned runs, nothing else, and the buildings that have changed are told, no others."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pytest

from cityflow.core.points import PointCloud
from cluster.second_epoch import CORRECTED, GONE, NEW, NEW_HEIGHT_M, NEW_PLACE, RAISED, RAISED_M, second_epoch
from cluster.small_city import (
    SCENE,
    Commands,
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


def test_exactly_the_changed_buildings_are_listed_also_when_the_driver_died(
    cityflow: Commands, copied_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
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
