"""Edits that nothing came of are named with their place and what to do; those that act, or may yet, are not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import geopandas
import numpy as np
import pytest
import shapely
from shapely import LineString, Point, box

from cityflow.catalog.create import SurveyFiles, create_catalog
from cityflow.core.grid import Grid
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.refused_outlines import refused_shapes
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import write_cog
from cityflow.reporting.unit_rows import _outlines
from cityflow.reporting.unused_edits import unused_edits
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.runs.settings import load_workflow
from cityflow.survey.area import Area
from cityflow.survey.city import OUTLINES
from cityflow.viewer.report_rows import EditRow
from cityflow.workflow.status import unused_lines
from in_process import outcome_of, record_of

CRS = "EPSG:28992"
X, Y = 90000.0, 460000.0
HOUSE, SHED, FAR = box(X + 20, Y + 20, X + 32, Y + 29), box(X + 60, Y + 60, X + 66, Y + 64), box(0, 0, 9, 9)
GIVEN = {"house": HOUSE, "shed": SHED, "twin": HOUSE, "faraway": FAR}
WORKFLOW = Path(__file__).parents[2] / "workflows" / "ortho_city.yaml"
EVERYWHERE = Area()


@pytest.fixture(scope="module")
def catalog(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("survey")
    dsm = np.full((180, 180), 3.0, np.float32)
    (folder / "dsm.tif").write_bytes(write_cog(dsm, Grid(X, Y + 180, 1.0, 180, 180), resolve(CRS)))
    outlines = geopandas.GeoDataFrame({"id": list(GIVEN)}, geometry=list(GIVEN.values()), crs=CRS)
    outlines.to_file(folder / "outlines.gpkg")
    made = folder / "catalog"
    create_catalog(
        made, SurveyFiles(dsm=folder / "dsm.tif", outlines=folder / "outlines.gpkg", id_column="id"), crs=CRS
    )
    return made


def prepared(
    catalog: Path, folder: Path, layers: dict[str, list[tuple[str, shapely.Geometry]]], *more: str
) -> Prepared:
    edits = folder / "edits.gpkg"
    for name, features in layers.items():
        columns = {"roof_type": [text for text, _ in features]}
        geopandas.GeoDataFrame(columns, geometry=[g for _, g in features], crs=CRS).to_file(edits, layer=name)
    settings = ["tiles.tile_m=100", *([f"edits.path={edits}"] if layers else []), *more]
    return Prepared(load_workflow(WORKFLOW, settings), read_catalog(catalog), EVERYWHERE, Store.open(folder / "run"))


def outlined(run: Prepared) -> CurrentRecords:
    """The records of a run that has come as far as outlines."""
    source, found = run.source(), dict[str, list[Record]]()
    ready = list(source.initial())
    while ready:
        task = ready.pop()
        if task.stage in ("ingest", "outline"):
            record = record_of(task, outcome_of(run.store, task))
            found.setdefault(task.stage, []).append(record)
            ready += source.after(task, record)
    return CurrentRecords(found)


def named(rows: tuple[EditRow, ...]) -> dict[str, list[tuple[float, float]]]:
    return {r.layer: [s.place for s in rows if s.layer == r.layer] for r in rows}


def test_edits_that_hit_nothing_are_named_with_place_and_remedy(catalog: Path, tmp_path: Path) -> None:
    beside, nowhere, outside = (X + 33.5, Y + 25.0), (X + 120, Y + 30), (X - 5000, Y)
    layers = {
        "roof_types": [("gable", HOUSE.centroid), ("hip", Point(beside)), ("flat", Point(outside)), ("shed", box(X + 60, Y + 60, X + 61, Y + 64))],
        "rejected": [("", SHED.centroid), ("", Point(nowhere))],
        "cut_lines": [("", LineString([(X + 26, Y + 19), (X + 26, Y + 30)])), ("", LineString([(X + 100, Y), (X + 100, Y + 9)]))],
    }  # fmt: skip
    run = prepared(catalog, tmp_path, layers, "split.when=never")
    rows = unused_edits(run, outlined(run))
    assert named(rows)["roof_types"] == [beside, outside, (X + 60.5, Y + 62)]
    assert named(rows)["rejected"] == [nowhere]
    assert len(named(rows)["cut_lines"]) == 2
    reasons = [r.text for r in rows if r.layer == "roof_types"]
    assert (
        reasons[0] == "roof_types 'hip' at 90033.50, 460025.00: touches no building; the nearest is house, 1.5 m away"
    )
    assert reasons[1].endswith("stands outside the survey")
    assert "which is refused: rejected by an edit" in reasons[2]
    assert all("move the point into the unit" in r.remedy for r in rows if r.layer == "roof_types")
    assert {r.remedy for r in rows if r.layer == "cut_lines"} == {"set split.when to found or always"}


def test_a_polygon_over_too_little_of_a_unit_says_how_little(catalog: Path, tmp_path: Path) -> None:
    run = prepared(catalog, tmp_path, {"roof_types": [("gable", box(X + 20, Y + 20, X + 23, Y + 29))]})
    (row,) = unused_edits(run, outlined(run))
    assert row.reason == "covers 25 % of unit house, less than half"


def test_what_is_not_known_yet_or_not_asked_for_is_not_judged(catalog: Path, tmp_path: Path) -> None:
    run = prepared(catalog, tmp_path, {"roof_types": [("gable", Point(X + 120, Y + 30))]})
    assert unused_edits(run, CurrentRecords({})) == ()
    records = outlined(run)
    assert len(unused_edits(run, records)) == 1
    assert unused_edits(replace(run, area=Area(box(X + 10, Y + 10, X + 40, Y + 40))), records) == ()


def test_an_outline_far_away_is_refused_and_makes_no_tile(catalog: Path, tmp_path: Path) -> None:
    run = prepared(catalog, tmp_path, {})
    assert run.catalog.bounds == (X, Y, X + 180, Y + 180)
    assert sorted(run.source().survey.lattice.tiles) == ["900_4600", "900_4601", "901_4600", "901_4601"]
    ingested = next(r for r in outlined(run).of("ingest") if r.unit == OUTLINES)
    refused = dict(ingested.result["refused"])
    assert "outside the survey" in refused["faraway"]
    assert refused["twin"] == "same polygon as house"
    shapes = refused_shapes(run.store, [ingested])
    assert shapes["faraway"].equals(FAR)
    assert shapes["twin"].equals(HOUSE)


def test_refused_outlines_have_rings_for_the_map(catalog: Path, tmp_path: Path) -> None:
    run = prepared(catalog, tmp_path, {"rejected": [("", SHED.centroid)]})
    found = _outlines(run, outlined(run))
    rings, tiles = found.rings, found.tiles
    assert sorted(rings) == ["faraway", "house", "shed", "twin"]
    assert sorted(tiles) == ["house"]
    assert shapely.Polygon(rings["shed"][0]).equals(SHED)


def test_the_console_names_them_and_counts_the_rest(catalog: Path, tmp_path: Path) -> None:
    missed = [("hip", Point(X + 120 + k, Y + 30)) for k in range(15)]
    run = prepared(catalog, tmp_path, {"roof_types": [("gable", HOUSE.centroid), *missed]})
    lines = list(unused_lines([(edit.text, edit.remedy) for edit in unused_edits(run, outlined(run))]))
    assert lines[0] == (
        "edit without effect: roof_types 'hip' at 90120.00, 460030.00: touches no building → "
        "move the point into the unit, or let the polygon cover half of it or more"
    )
    assert len(lines) == 13
    assert "3 more edits without effect" in lines[-1]
