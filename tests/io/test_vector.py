from __future__ import annotations

import json
from datetime import date
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely

from cityflow.core.building import Scalar
from cityflow.errors import CatalogError
from cityflow.io.crs import resolve
from cityflow.io.tables.feature_ids import format_id
from cityflow.io.tables.outline_file import read_outlines
from cityflow.io.tables.vector import read_layer, read_polygons
from survey_files import DELFT, houses, write_outlines

RD = resolve("EPSG:7415")
REGISTER = DELFT / "data" / "bgt_pand_28992.gpkg"


def test_real_footprints_keep_ids_attributes_and_vertices() -> None:
    outlines, notes = read_outlines(REGISTER, "identificatiebagpnd", "{:016d}", RD)
    assert notes == []
    assert len({o.id for o in outlines}) == len(outlines) == 160
    assert all(len(o.id) == 16 and o.id.startswith("0503100000") for o in outlines)
    assert all(o.polygon.exterior.is_ccw for o in outlines)
    truth = gpd.read_file(REGISTER)
    assert all(o.polygon.equals(g) for o, g in zip(outlines, truth.geometry, strict=True))
    assert set(outlines[0].attributes) == set(truth.columns) - {"geometry"}
    assert [o.attributes["identificatiebagpnd"] for o in outlines] == truth["identificatiebagpnd"].tolist()
    json.dumps([dict(o.attributes) for o in outlines], allow_nan=False)


def test_attributes_become_json_scalars_without_loss(tmp_path: Path) -> None:
    big = 2**53 + 1
    columns: dict[str, Any] = {
        "big": pd.array([big, None], dtype="Int64"),
        "share": [0.25, np.nan],
        "day": [date(2020, 2, 29), None],
        "moment": pd.Series([pd.Timestamp(2020, 2, 29, 12, 30), None]),
        "yes": [True, False],
        "name": ["Haus Ö", None],
    }
    path = write_outlines(tmp_path / "a.gpkg", houses(2), **columns)
    first, second = (dict(o.attributes) for o in read_outlines(path, None, None, RD)[0])
    assert first["big"] == big
    assert (first["share"], first["yes"], first["name"]) == (0.25, True, "Haus Ö")
    assert first["day"] == "2020-02-29"
    assert str(first["moment"]).startswith("2020-02-29T12:30:00")
    assert second == {"big": None, "share": None, "day": None, "moment": None, "yes": False, "name": None}


def test_degrees_are_reprojected_and_said_so(tmp_path: Path) -> None:
    truth = houses()
    there = gpd.GeoSeries(truth, crs="EPSG:28992").to_crs("EPSG:4326")
    outlines, notes = read_outlines(write_outlines(tmp_path / "a.gpkg", list(there), "EPSG:4326"), None, None, RD)
    assert any("reprojected" in n and "WGS 84" in n for n in notes)
    for outline, polygon in zip(outlines, truth, strict=True):
        assert outline.polygon.hausdorff_distance(shapely.orient_polygons(polygon)) < 0.001


def test_without_crs_the_catalogs_is_assumed_where_the_coordinates_fit(tmp_path: Path) -> None:
    path = write_outlines(tmp_path / "a.shp", houses(), None)
    assert not path.with_suffix(".prj").exists()
    outlines, notes = read_outlines(path, None, None, RD)
    assert len(outlines) == 4
    assert any("states no CRS" in n and "RD New" in n for n in notes)
    degrees = [shapely.box(4.365, 52.011, 4.366, 52.012)]
    with pytest.raises(CatalogError, match="degrees"):
        read_outlines(write_outlines(tmp_path / "b.shp", degrees, None), None, None, RD)


def test_geojson_in_metres_is_understood(tmp_path: Path) -> None:
    # GeoJSON cannot state its CRS, so readers claim WGS 84.
    features = [{"type": "Feature", "properties": {}, "geometry": shapely.geometry.mapping(h)} for h in houses()]
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    for target in (RD, resolve("local")):
        outlines, notes = read_outlines(path, None, None, target)
        assert outlines[0].polygon.equals(houses()[0])
        assert any("no degrees" in n for n in notes)


def test_degrees_have_no_place_in_a_local_frame(tmp_path: Path) -> None:
    path = write_outlines(tmp_path / "a.gpkg", [shapely.box(4.365, 52.011, 4.366, 52.012)], "EPSG:4326")
    with pytest.raises(CatalogError, match="local frame"):
        read_outlines(path, None, None, resolve("local"))


def test_every_feature_is_accounted_for(tmp_path: Path) -> None:
    a, b, c, d = houses()
    shapes = [a, None, shapely.MultiPolygon([b]), shapely.MultiPolygon([c, d]), shapely.Polygon()]
    path = write_outlines(tmp_path / "a.gpkg", shapes, id=["a", "b", "c", "d", "e"])
    outlines, notes = read_outlines(path, "id", None, RD)
    assert [o.id for o in outlines] == ["a", "b", "c", "d", "e"]
    assert [o.polygon.geom_type for o in outlines] == ["Polygon", "Polygon", "Polygon", "MultiPolygon", "Polygon"]
    assert [o.polygon.is_empty for o in outlines] == [False, True, False, False, True]
    assert any("without geometry: 2 (b, e)" in n for n in notes)
    assert any("several parts: 1" in n for n in notes)


def test_heights_of_vertices_are_dropped_and_clockwise_rings_turned(tmp_path: Path) -> None:
    ring = [(x, y, 5.0) for x, y in reversed(houses(1)[0].exterior.coords)]
    path = write_outlines(tmp_path / "a.gpkg", [shapely.Polygon(ring)])
    polygon = read_outlines(path, None, None, RD)[0][0].polygon
    assert not polygon.has_z
    assert shapely.is_ccw(polygon.exterior)


def test_self_crossing_polygons_pass_for_cleaning(tmp_path: Path) -> None:
    bow = shapely.Polygon([(84900, 447500), (84910, 447510), (84910, 447500), (84900, 447510)])
    outlines, _ = read_outlines(write_outlines(tmp_path / "a.gpkg", [bow]), None, None, RD)
    assert not outlines[0].polygon.is_valid


@pytest.mark.parametrize(
    ("value", "form", "expected"), [(7, "{:04d}", "0007"), ("7", "{:04d}", "0007"), (7.0, None, "7"), (None, "{}", "")]
)
def test_ids_are_formatted(value: Scalar, form: str | None, expected: str) -> None:
    assert format_id(value, form) == expected


def test_missing_and_repeated_ids_are_said(tmp_path: Path) -> None:
    path = write_outlines(tmp_path / "a.gpkg", houses(), bag=pd.array([5, None, 5, 6], dtype="Int64"))
    outlines, notes = read_outlines(path, "bag", "{:03d}", RD)
    assert [o.id for o in outlines] == ["005", "", "005", "006"]
    assert any("without an id: 1" in n for n in notes)
    assert any("more than once: 1 (005)" in n for n in notes)


def test_wrong_column_names_the_nearest_and_wrong_format_the_column(tmp_path: Path) -> None:
    path = write_outlines(tmp_path / "a.gpkg", houses(), gebouw=["x", "y", "z", "w"])
    with pytest.raises(CatalogError, match="did you mean 'gebouw'"):
        read_outlines(path, "gebow", None, RD)
    with pytest.raises(CatalogError, match="'gebouw'"):
        read_outlines(path, "gebouw", "{:016d}", RD)


def test_lines_alone_are_refused_and_named_among_polygons(tmp_path: Path) -> None:
    line = shapely.LineString([(84900, 447500), (84910, 447510)])
    with pytest.raises(CatalogError, match="1 × LineString"):
        read_outlines(write_outlines(tmp_path / "a.gpkg", [line]), None, None, RD)
    outlines, notes = read_outlines(write_outlines(tmp_path / "b.gpkg", [*houses(1), line]), None, None, RD)
    assert len(outlines) == 2
    assert any("LineString" in n for n in notes)


def test_unreadable_missing_and_several_layers(tmp_path: Path) -> None:
    (tmp_path / "bad.gpkg").write_bytes(b"SQLite format 3\x00" + bytes(2000))
    with pytest.raises(CatalogError, match=r"bad\.gpkg"):
        read_outlines(tmp_path / "bad.gpkg", None, None, RD)
    with pytest.raises(CatalogError, match=r"none\.gpkg"):
        read_outlines(tmp_path / "none.gpkg", None, None, RD)
    frame = gpd.GeoDataFrame(geometry=houses(), crs="EPSG:28992")
    for layer in ("roofs", "walls"):
        pyogrio.write_dataframe(frame, tmp_path / "two.gpkg", layer=layer)
    with pytest.raises(CatalogError, match="roofs, walls"):
        read_layer(tmp_path / "two.gpkg")
    assert len(read_layer(tmp_path / "two.gpkg", "walls").geometry) == 4
    with pytest.raises(CatalogError, match="no layer 'floors'"):
        read_layer(tmp_path / "two.gpkg", "floors")


def test_remote_file(tmp_path: Path) -> None:
    import fsspec

    with fsspec.open("memory://outlines/a.gpkg", "wb") as file:
        file.write(Path(REGISTER).read_bytes())
    assert len(read_outlines("memory://outlines/a.gpkg", None, None, RD)[0]) == 160


def test_area_of_interest_comes_as_polygons(tmp_path: Path) -> None:
    a, b, c, _ = houses()
    path = write_outlines(tmp_path / "a.gpkg", [a, None, shapely.MultiPolygon([b, c])])
    assert sum(p.area for p in read_polygons(path, RD)) == pytest.approx(3 * 64)
    assert len(read_polygons(path, RD)) == 3
