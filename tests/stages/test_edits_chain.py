"""Edits that a person drew, through the stages: they override what was found, only what they touch has another task, and the rest keeps its bytes."""

from __future__ import annotations

from pathlib import Path

import geopandas
import numpy as np
import pytest
import shapely

from cityflow.core.building import Status
from cityflow.errors import CatalogError, WorkflowError
from cityflow.io.catalog.stac import read_catalog
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.prepare import prepared
from cluster.small_city import SmallCity, make_city
from stages.test_chain import Done, run_here

CRS = "EPSG:28992"


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> SmallCity:
    made = make_city(tmp_path_factory.mktemp("town"))
    made.change_workflow(outline={"source": "found", "found": {"halo_m": 50, "reach_m": 50}})
    return made


@pytest.fixture(scope="module")
def plain(city: SmallCity, tmp_path_factory: pytest.TempPathFactory) -> Done:
    return run_here(city, tmp_path_factory.mktemp("plain"), seed=0)


def units(path: Path) -> geopandas.GeoDataFrame:
    return geopandas.read_file(path, layer="units").set_index("id").sort_index()


def across(polygon: shapely.Polygon) -> shapely.LineString:
    """A line across the middle of a building, along its shorter side and a little longer."""
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygon))[:4]
    long_first = np.linalg.norm(box[1] - box[0]) > np.linalg.norm(box[2] - box[1])
    a, b, c, d = box if long_first else np.roll(box, -1, axis=0)
    start, end = (a + b) / 2, (c + d) / 2
    out = (end - start) / np.linalg.norm(end - start) * 0.3
    return shapely.LineString([start - out, end + out])


def test_a_drawn_cut_splits_a_rejected_one_goes_and_nothing_else_runs_again(
    city: SmallCity, plain: Done, tmp_path: Path
) -> None:
    before = units(plain.folder / "products" / "outlines.gpkg")
    alone = [
        i for i in before.index
        if (before.geometry.distance(before.geometry[i]) < 3).sum() == 1 and before.geometry[i].area > 60
    ]  # fmt: skip
    cut, gone = alone[0], alone[1]
    edits = tmp_path / "edits.gpkg"
    geopandas.GeoDataFrame(geometry=[across(before.geometry[cut])], crs=CRS).to_file(edits, layer="cut_lines")
    point = before.geometry[gone].representative_point()
    geopandas.GeoDataFrame(geometry=[point], crs=CRS).to_file(edits, layer="rejected")
    city.change_workflow(
        outline={"source": "found", "found": {"halo_m": 50, "reach_m": 50}}, edits={"path": str(edits)}
    )
    records = run_here(city, tmp_path / "run", seed=1, known=plain).records
    after = units(tmp_path / "run" / "products" / "outlines.gpkg")

    assert gone not in after.index
    assert records["reconstruct", gone].status is Status.REFUSED
    assert records["reconstruct", gone].reason == "rejected by an edit"
    halves = after[after.index.str.startswith(f"{cut}.")]
    assert len(halves) == 2
    assert halves.geometry.area.sum() == pytest.approx(before.geometry[cut].area, abs=1e-3)
    assert halves.geometry.area.min() > 0.3 * before.geometry[cut].area
    lines = geopandas.read_file(tmp_path / "run" / "products" / "outlines.gpkg", layer="cut_lines")
    assert list(lines[lines.kind == "edit"].outline) == [cut]
    others = [u for u in before.index if u not in (cut, gone)]
    assert sorted(after.index) == sorted([*others, *halves.index])
    # what no edit touches has the task that it had
    same = [u for u in others if records["reconstruct", u].digest == plain.records["reconstruct", u].digest]
    assert same == others
    splits = [u for s, u in plain.records if s == "split" and (s, u) in records]
    assert [u for u in splits if records["split", u].digest != plain.records["split", u].digest] == [cut]


def test_a_file_of_edits_that_is_not_there_is_said_before_anything_runs(
    city: SmallCity, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(WorkflowError, match=r"none\.gpkg") as missing:
        prepared(city.workflow, str(city.catalog), str(tmp_path / "run"), ["edits.path=none.gpkg"], "")
    text = str(missing.value)
    assert str(tmp_path / "none.gpkg") in text
    assert str(city.workflow.parent / "none.gpkg") in text
    assert "catalog check" not in text


def test_a_file_of_edits_that_has_gone_since_is_said(city: SmallCity, tmp_path: Path) -> None:
    edits = tmp_path / "edits.gpkg"
    geopandas.GeoDataFrame(geometry=[shapely.Point(0, 0)], crs=CRS).to_file(edits, layer="rejected")
    wanted = prepared(city.workflow, str(city.catalog), str(tmp_path / "run"), [f"edits.path={edits}"], "")
    edits.unlink()
    with pytest.raises(CatalogError, match=r"edits\.gpkg.*edits\.path"):
        list(CitySource(read_catalog(city.catalog), wanted.workflow.city).initial())


def test_a_drawn_cut_splits_a_given_outline_and_no_other(city: SmallCity, tmp_path: Path) -> None:
    given = geopandas.read_file(city.outlines)
    house = max(range(len(given)), key=lambda k: given.geometry[k].area)
    edits = tmp_path / "edits.gpkg"
    geopandas.GeoDataFrame(geometry=[across(given.geometry[house])], crs=CRS).to_file(edits, layer="cut_lines")
    city.change_workflow(outline={"source": "given"}, edits={"path": str(edits)})
    records = run_here(city, tmp_path / "run", seed=2).records
    name = given["name"][house]
    found = units(tmp_path / "run" / "products" / "outlines.gpkg")
    assert sorted(i for i in found.index if i.startswith(name)) == sorted(i for i in found.index if "." in i)
    assert sum(i.startswith(f"{name}.") for i in found.index) == 2
    assert len(found) == len(given) + 1
    reasons = {r.reason for (stage, unit), r in records.items() if stage == "split" and unit != name}
    assert reasons == {"a single unit already"}
