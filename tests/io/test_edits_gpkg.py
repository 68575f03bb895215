from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import geopandas
import numpy as np
import pyogrio
import pytest
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from cityflow.core.edits import DrawnOutline, Edits, edits_digest
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.tables.edits_gpkg import read_edits

X, Y = 84_900.0, 447_500.0


def _box(x: float, y: float, width: float, depth: float) -> Polygon:
    return box(X + x, Y + y, X + x + width, Y + y + depth)


def _line(*xy: tuple[float, float]) -> LineString:
    return LineString([(X + x, Y + y) for x, y in xy])


def _write(
    path: Path, layer: str, shapes: Sequence[BaseGeometry | None], crs: str = "EPSG:28992", **columns: list[str | None]
) -> Path:
    geopandas.GeoDataFrame(columns, geometry=list(shapes), crs=crs).to_file(path, layer=layer, driver="GPKG")
    return path


@pytest.fixture
def edits_file(tmp_path: Path) -> Path:
    path = tmp_path / "edits.gpkg"
    _write(path, "outlines", [_box(0, 0, 10, 10), _box(20, 0, 10, 10)], id=["a", None])
    _write(path, "cut_lines", [_line((5, -1), (5, 11))])
    _write(path, "no_cut_lines", [_line((40, 0), (40, 10))])
    _write(path, "locked", [_box(60, 0, 8, 10)], id=["villa"])
    _write(path, "rejected", [Point(X + 100, Y), _box(110, 0, 5, 5)])
    return path


def test_every_layer_is_read(edits_file: Path, amersfoort: Reference) -> None:
    edits = read_edits(str(edits_file), amersfoort)
    assert [(o.id, o.locked) for o in edits.outlines] == [("villa", True), ("a", False), ("", False)]
    assert edits.outlines[1].polygon.equals(_box(0, 0, 10, 10))
    assert all(o.polygon.exterior.is_ccw for o in edits.outlines)
    assert edits.cut_lines[0].equals(_line((5, -1), (5, 11)))
    assert edits.no_cut_lines[0].equals(_line((40, 0), (40, 10)))
    assert [g.geom_type for g in edits.rejected] == ["Point", "Polygon"]
    assert (len(edits), edits.notes) == (7, ())


def test_written_by_the_program_that_people_draw_with(tmp_path: Path, amersfoort: Reference) -> None:
    """Multi-polygons with heights, features without geometry, a table of styles: what QGIS leaves in a file."""
    path = tmp_path / "edits.gpkg"
    two = MultiPolygon([shapely.force_3d(_box(0, 0, 10, 10), 7.0), _box(20, 0, 10, 10)])
    _write(path, "locked", [two, None, _box(40, 0, 5, 5)], id=["row", "lost", "7"])
    pyogrio.write_dataframe(geopandas.pd.DataFrame({"styleName": ["red"]}), path, layer="layer_styles")
    edits = read_edits(str(path), amersfoort)
    assert [o.id for o in edits.outlines] == ["row-1", "row-2", "7"]
    assert not any(o.polygon.has_z for o in edits.outlines)


def test_another_crs_is_reprojected_and_said_so(edits_file: Path, tmp_path: Path, amersfoort: Reference) -> None:
    degrees = tmp_path / "degrees.gpkg"
    geopandas.read_file(edits_file, layer="locked").to_crs(4326).to_file(degrees, layer="locked", driver="GPKG")
    edits = read_edits(str(degrees), amersfoort)
    assert edits.outlines[0].polygon.hausdorff_distance(_box(60, 0, 8, 10)) < 0.01
    assert "layer locked of degrees.gpkg was reprojected from WGS 84" in edits.notes[0]


@pytest.mark.parametrize(
    ("layer", "shape", "problem"),
    [
        ("outlines", _line((0, 0), (5, 5)), "feature 1 of layer outlines is a LineString → draw it as Polygon"),
        ("cut_lines", _box(0, 0, 5, 5), "is a Polygon → draw it as LineString"),
        ("rejected", _line((0, 0), (5, 5)), "is a LineString → draw it as Point or Polygon"),
        ("cut_lines", _line((0, 0), (5, 1), (10, 0)), "is not straight (it bends by 1.00 m)"),
        ("no_cut_lines", _line((0, 0), (0.02, 0)), "has a length of 0.020 m"),
        ("locked", Polygon([(X, Y), (X + 9, Y + 9), (X + 9, Y), (X, Y + 9)]), "is no valid polygon (Self-intersection"),
        ("locked", _box(0, 0, 0.1, 0.1), "has an area of 0.010 m²"),
        ("locks", _box(0, 0, 9, 9), "edits know no layer 'locks' → did you mean 'locked'?"),
        ("units", _box(0, 0, 9, 9), "keep other layers in another file"),
    ],
)
def test_what_cannot_be_meant_is_refused(
    layer: str, shape: BaseGeometry, problem: str, tmp_path: Path, amersfoort: Reference
) -> None:
    path = _write(tmp_path / "edits.gpkg", layer, [shape])
    with pytest.raises(CatalogError) as refusal:
        read_edits(str(path), amersfoort)
    assert problem in str(refusal.value)
    assert "edits.gpkg" in str(refusal.value)


def test_the_same_id_twice(tmp_path: Path, amersfoort: Reference) -> None:
    path = _write(tmp_path / "edits.gpkg", "outlines", [_box(0, 0, 9, 9), _box(20, 0, 9, 9)], id=["a", "a"])
    with pytest.raises(CatalogError, match="'a' occurs more than once"):
        read_edits(str(path), amersfoort)


def test_missing_unreadable_and_without_layers(tmp_path: Path, amersfoort: Reference) -> None:
    with pytest.raises(CatalogError, match="is not there"):
        read_edits(str(tmp_path / "edits.gpkg"), amersfoort)
    (tmp_path / "text.gpkg").write_text("edits")
    with pytest.raises(CatalogError, match="cannot be read"):
        read_edits(str(tmp_path / "text.gpkg"), amersfoort)
    pyogrio.write_dataframe(geopandas.pd.DataFrame({"a": [1]}), tmp_path / "table.gpkg", layer="table")
    with pytest.raises(CatalogError, match="no layer with geometries"):
        read_edits(str(tmp_path / "table.gpkg"), amersfoort)


def test_empty_layers_are_no_error(tmp_path: Path, amersfoort: Reference) -> None:
    path = tmp_path / "edits.gpkg"
    _write(path, "locked", [_box(0, 0, 9, 9)])
    kept = geopandas.read_file(path, layer="locked").iloc[:0]
    path.unlink()
    kept.to_file(path, layer="locked", driver="GPKG")
    edits = read_edits(str(path), amersfoort)
    assert len(edits) == 0
    assert "holds no edit" in edits.notes[0]


def test_only_edits_near_a_place_change_its_digest(edits_file: Path, amersfoort: Reference) -> None:
    edits = read_edits(str(edits_file), amersfoort)
    house, far = _box(0, 0, 10, 10), _box(500, 500, 10, 10)
    assert edits_digest(edits, far) == ""
    before = edits_digest(edits, house)
    assert len(before) == 64
    elsewhere = Edits(edits.outlines, edits.cut_lines, (), edits.rejected)
    assert edits_digest(elsewhere, house) == before
    moved = Edits(edits.outlines, (_line((5.001, -1), (5, 11)),), edits.no_cut_lines, edits.rejected)
    assert edits_digest(moved, house) != before
    assert edits_digest(edits, house.bounds) == before
    beside = _box(10.5, 0, 5, 5)
    assert edits_digest(edits, beside) != ""


def test_lines_bring_every_edit_back_bit_for_bit() -> None:
    odd = Polygon(np.array([[0.1, 0.2], [10 / 3, 0.0], [2.0, 7.7777]]))
    edits = Edits(
        (DrawnOutline(odd, 'tab\t"quoted"\n', True), DrawnOutline(odd)),
        (_line((0, 0), (1, 3)),),
        (),
        (Point(1 / 3, 2),),
    )
    assert Edits.from_lines(edits.lines()) == edits
    assert Edits.from_lines([]) == Edits()


def test_within_a_box() -> None:
    edits = Edits(cut_lines=(_line((0, 0), (0, 5)), _line((50, 0), (50, 5))))
    assert len(edits.within((X - 5, Y, X - 0.5, Y + 2))) == 1
    assert len(edits.within((X - 5, Y, X - 1.5, Y + 2))) == 0


def test_roof_types_name_the_unit_that_they_stand_on(tmp_path: Path, amersfoort: Reference) -> None:
    path = _write(
        tmp_path / "edits.gpkg",
        "roof_types",
        [Point(X + 5, Y + 5), _box(20, 0, 10, 6), Point(X + 25, Y + 50)],
        roof_type=["hip", "gable", "flat"],
    )
    edits = read_edits(str(path), amersfoort)
    again = Edits.from_lines(edits.lines())
    for one in (edits, again):
        assert one.roof_type_of(_box(0, 0, 10, 10)) == "hip"
        assert one.roof_type_of(_box(20, 0, 10, 10)) == "gable"
        assert one.roof_type_of(_box(20, 0, 40, 10)) == ""
    assert edits_digest(edits, box(X, Y, X + 10, Y + 10)) != edits_digest(edits, box(X + 20, Y, X + 30, Y + 10))


@pytest.mark.parametrize(("name", "advice"), [("gabel", "did you mean 'gable'"), ("thatched", "takes flat, shed")])
def test_a_roof_type_that_nobody_knows_is_refused(
    tmp_path: Path, amersfoort: Reference, name: str, advice: str
) -> None:
    path = _write(tmp_path / "edits.gpkg", "roof_types", [Point(X, Y)], roof_type=[name])
    with pytest.raises(CatalogError, match=f"no roof type {name!r}") as error:
        read_edits(str(path), amersfoort)
    assert advice in str(error.value)
