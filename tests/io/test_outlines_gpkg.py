from __future__ import annotations

import sqlite3
from dataclasses import replace
from pathlib import Path

import geopandas
import pyogrio
import pytest
from shapely import LineString, Point, box

from cityflow.core.building import Building, Outline, OutlineEdge, Scalar, Status
from cityflow.core.reference import Reference
from cityflow.core.splitting import CutLine, Splitting
from cityflow.io.tables.outlines_gpkg import (
    Layer,
    cut_line_layer,
    outline_edge_layer,
    outline_layer,
    roof_layer,
    status_layer,
    unit_layer,
    write_geopackage,
)


@pytest.fixture
def layers(buildings: list[Building]) -> list[Layer]:
    outlines = [Outline(b.id, b.footprint, dict(b.attributes), "") for b in buildings[:3]]
    outlines[1] = replace(outlines[1], remark="self-crossing mended")
    return [
        outline_layer(outlines),
        unit_layer(buildings),
        status_layer(
            (b.id, Point(1, 2) if b.footprint.is_empty else b.footprint, b.status, b.reason) for b in buildings
        ),
    ]


def _written(folder: Path, layers: list[Layer], reference: Reference) -> Path:
    (folder / "outlines.gpkg").write_bytes(write_geopackage(layers, reference))
    return folder / "outlines.gpkg"


def test_all_layers_are_read_with_crs_and_geometry(
    layers: list[Layer], tmp_path: Path, amersfoort: Reference, buildings: list[Building]
) -> None:
    path = _written(tmp_path, layers, amersfoort)
    assert pyogrio.list_layers(path).tolist() == [["outlines", "Polygon"], ["units", "Polygon"], ["status", "Unknown"]]
    assert pyogrio.read_info(path, layer="units")["layer_metadata"]["VERTICAL_DATUM"] == "NAP height"
    with sqlite3.connect(path) as file:
        said = dict(file.execute("SELECT table_name, description FROM gpkg_contents"))
    assert said["units"].startswith("Buildings with all attributes")
    assert all(said.values())
    units = geopandas.read_file(path, layer="units")
    assert units.crs.to_epsg() == 28992
    assert units["id"].tolist() == [b.id for b in buildings]
    for geometry, building in zip(units.geometry[:3], buildings, strict=False):
        assert geometry.equals_exact(building.footprint, 0.0)
    assert units.geometry[3] is None


def test_attributes_keep_their_types(layers: list[Layer], tmp_path: Path, amersfoort: Reference) -> None:
    units = geopandas.read_file(_written(tmp_path, layers, amersfoort), layer="units")
    first, second = units.iloc[0], units.iloc[1]
    assert first["identificatiebagpnd"] == 503100000018603
    assert first["nmad_m"] == 0.3
    assert units["nmad_m"].isna().tolist() == [False, True, False, True]
    assert bool(first["inonderzoek"]) is False
    assert first["hoek"] is None
    assert first['Größe <m²> & "mehr"'] == "ä<&>\ufffd'\""
    assert second["status"] == "bestaand"
    assert (second["cityflow_status"], second["cityflow_reason"][:10]) == ("degraded", "two planes")


def test_whole_numbers_are_stored_as_whole_numbers(layers: list[Layer], tmp_path: Path, local: Reference) -> None:
    with sqlite3.connect(_written(tmp_path, layers, local)) as connection:
        kinds = connection.execute("select typeof(identificatiebagpnd), typeof(nmad_m) from units").fetchall()
        assert kinds == [("integer", "real"), ("integer", "null"), ("integer", "real"), ("null", "null")]
        assert connection.execute("select distinct last_change from gpkg_contents").fetchall() == [
            ("2000-01-01T00:00:00.000Z",)
        ]
        assert connection.execute("pragma integrity_check").fetchall() == [("ok",)]


def test_the_status_map_has_every_unit(layers: list[Layer], tmp_path: Path, local: Reference) -> None:
    status = geopandas.read_file(_written(tmp_path, layers, local), layer="status")
    assert status.crs is None or not status.crs.to_epsg()
    assert status["status"].tolist() == ["done", "degraded", "done", "refused"]
    assert status["reason"].tolist()[3] == "outline has no area"
    assert status.geometry[3].equals(Point(1, 2))


def test_names_that_sqlite_confuses_stay_apart(tmp_path: Path, local: Reference) -> None:
    row: dict[str, Scalar] = {"id": "a", "FID": 1, "Geom": "x", "Name": 1.5, "name": 2, "NAME_2": True, "": "empty"}
    layer = Layer("units", [Point(0, 0)], [row])
    read = geopandas.read_file(_written(tmp_path, [layer], local), layer="units")
    assert read.drop(columns="geometry").iloc[0].tolist() == ["a", 1, "x", 1.5, 2, True, "empty"]


def test_a_source_column_called_id_survives(tmp_path: Path, local: Reference, gable: Building) -> None:
    layer = unit_layer([replace(gable, attributes={"id": "source's"})])
    read = geopandas.read_file(_written(tmp_path, [layer], local), layer="units")
    assert (read["id"][0], read["source_id"][0]) == (gable.id, "source's")


def test_mixed_types_become_text(tmp_path: Path, local: Reference) -> None:
    rows: list[dict[str, Scalar]] = [{"a": 1, "b": 2**70}, {"a": "x", "b": 1}, {"a": True}, {}]
    read = geopandas.read_file(_written(tmp_path, [Layer("t", [None] * 4, rows)], local), layer="t")
    assert read["a"].tolist()[:3] == ["1", "x", "true"]
    assert read["a"].isna().tolist() == [False, False, False, True]
    assert read["b"].tolist()[:2] == [str(2**70), "1"]


def test_nothing_is_a_layer_too(tmp_path: Path, amersfoort: Reference) -> None:
    path = _written(tmp_path, [outline_layer([]), status_layer([])], amersfoort)
    assert len(geopandas.read_file(path, layer="outlines")) == 0
    assert pyogrio.read_info(path, layer="status")["features"] == 0


def test_the_same_layers_give_the_same_bytes(layers: list[Layer], amersfoort: Reference) -> None:
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": "1999-09-09T00:00:00Z"})
    try:
        assert write_geopackage(layers, amersfoort) == write_geopackage(layers, amersfoort)
        assert pyogrio.get_gdal_config_option("OGR_CURRENT_DATE") == "1999-09-09T00:00:00Z"
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": None})


def test_statuses_are_those_of_the_model() -> None:
    rows = status_layer((s.value, None, s, "") for s in Status).rows
    assert [row["status"] for row in rows] == ["done", "degraded", "failed", "refused"]


@pytest.fixture
def seen_outline() -> Outline:
    wall = OutlineEdge(LineString([(0, 0), (10, 0)]), "wall", 0.0312345, 0.8)
    roof = OutlineEdge(LineString([(10, 0), (10, 8)]), "roof")
    inner = OutlineEdge(LineString([(4, 0), (4, 8)]), "wall", 0.05, 1.0)
    return Outline("a", box(0, 0, 10, 8), roof=box(-0.5, 0, 10.5, 8), edges=(wall, roof), inner_edges=(inner,))


def test_edges_say_where_they_come_from(seen_outline: Outline, tmp_path: Path, amersfoort: Reference) -> None:
    plain = replace(seen_outline, id="b", roof=None, edges=(), inner_edges=())
    both = [plain, seen_outline]
    path = _written(tmp_path, [outline_layer(both), outline_edge_layer(both), roof_layer(both)], amersfoort)
    assert pyogrio.list_layers(path).tolist()[1:] == [["outline_edges", "LineString"], ["roofs", "Polygon"]]
    edges = geopandas.read_file(path, layer="outline_edges")
    assert edges["outline"].tolist() == ["a", "a", "a"]
    assert edges["source"].tolist() == ["wall", "roof", "wall"]
    assert edges["sigma_m"].tolist()[::2] == [0.0312, 0.05]
    assert edges["sigma_m"].isna().tolist() == [False, True, False]
    assert edges["inner"].tolist() == [False, False, True]
    assert edges.geometry[2].equals(LineString([(4, 0), (4, 8)]))
    roofs = geopandas.read_file(path, layer="roofs")
    assert (roofs["id"].tolist(), roofs["overhang_m2"].tolist()) == (["a"], [8.0])


def test_cut_lines_show_also_what_was_not_used(tmp_path: Path, amersfoort: Reference) -> None:
    cut = CutLine(LineString([(4, 0), (4, 8)]), "cut", 0.5, 0.25, 1.23456, 0.0, 0.9, 0.3)
    weak = CutLine(LineString([(7, 0), (7, 8)]), "gap", gap_m=1.5, confidence=0.2)
    layer = cut_line_layer(
        [("a", Splitting((box(0, 0, 4, 8),), (cut,), (weak,))), ("b", Splitting((box(0, 0, 1, 1),)))]
    )
    path = _written(tmp_path, [layer], amersfoort)
    read = geopandas.read_file(path, layer="cut_lines")
    assert read.crs.to_epsg() == 28992
    assert read["outline"].tolist() == ["a", "a"]
    assert read["used"].tolist() == [True, False]
    assert read["kind"].tolist() == ["cut", "gap"]
    assert read[["vertical", "sloped", "height_step_m", "gap_m", "confidence"]].to_numpy().tolist() == [
        [0.5, 0.25, 1.2346, 0.0, 0.9], [0.0, 0.0, 0.0, 1.5, 0.2],
    ]  # fmt: skip
    assert read["angle_sigma_deg"].isna().tolist() == [False, True]
    assert write_geopackage([layer], amersfoort) == write_geopackage([layer], amersfoort)


def test_layers_of_lines_are_so_without_any_line(tmp_path: Path, amersfoort: Reference) -> None:
    path = _written(tmp_path, [outline_edge_layer([]), cut_line_layer([]), roof_layer([])], amersfoort)
    kinds = [["outline_edges", "LineString"], ["cut_lines", "LineString"], ["roofs", "Polygon"]]
    assert pyogrio.list_layers(path).tolist() == kinds
