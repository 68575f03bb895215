"""Windows in CityGML and CityJSON, as foreign readers find them."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
from pathlib import Path
from types import ModuleType
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
from lxml import etree

from cityflow.core.building import Building, Lod
from cityflow.core.openings import TOO_LITTLE, FaceOpenings, Opening, OpeningKind, UnitOpenings
from cityflow.core.reference import Reference
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.cityjson_sequence import document, extent_of, header_line
from citygml_schema import citygml_schema

NS = {"b": "http://www.opengis.net/citygml/building/2.0", "gml": "http://www.opengis.net/gml", "g": "http://www.opengis.net/citygml/generics/2.0"}  # fmt: skip
HREF = "{http://www.w3.org/1999/xlink}href"
GML_ID = f"{{{NS['gml']}}}id"
SCHEMAS = Path(__file__).parents[1] / "data" / "schemas" / "cityjson-2.0.2"
SURVEY = Transform(84000, 447000, 0)
WALL, COARSE, LITTLE_SEEN = 1, 3, 4
AREA_M2 = 2 * 1.2 * 1.4 + 1.0 * 2.1


@pytest.fixture
def found(gable: Building) -> UnitOpenings:
    """Two windows and a door in the first wall of the gabled house, and one in its party wall, which has none."""
    wall = ("solid", WALL)
    x, y = gable.solids[Lod.LOD22].vertices[0][:2]

    def opening(s: float, z: float, wide: float, high: float, kind: OpeningKind) -> Opening:
        ring = np.array([[s, 0, z], [s + wide, 0, z], [s + wide, 0, z + high], [s, 0, z + high]]) + np.array([x, y, 0])
        return Opening(wall, np.round(ring, 4), (s, z, s + wide, z + high), kind, 0.91, completed=s > 5)  # type: ignore[arg-type]

    openings = (
        opening(1, 0.2, 1.2, 1.4, "window"),
        opening(6, 0.2, 1.2, 1.4, "window"),
        opening(3.5, -1.2, 1, 2.1, "door"),
    )
    party = FaceOpenings(("solid", 2), (opening(1, 0, 1, 1, "window"),), 1, 50.0, 40.0, 0.1)
    little = FaceOpenings(("solid", LITTLE_SEEN), (), 0, 40.0, 4.0, None)
    coarse = FaceOpenings(("solid", COARSE), (), 0, 40.0, 10.0, None, "too coarse")
    return UnitOpenings((FaceOpenings(wall, openings, 1, 52.0, 50.0, 0.07), party, coarse, little), 2, 0.07)  # type: ignore[arg-type]


def _gml(buildings: list[Building], reference: Reference, **more: Any) -> bytes:
    target = io.BytesIO()
    write_citygml(target, buildings, reference, extent_of(buildings), **more)
    return target.getvalue()


def test_nothing_changes_where_no_windows_are_known(buildings: list[Building], amersfoort: Reference) -> None:
    assert _gml(buildings, amersfoort) == _gml(
        buildings, amersfoort, openings={"somewhere else": UnitOpenings((), None, None)}
    )
    for b in buildings:
        assert feature_line(b) == feature_line(b, openings={b.id: UnitOpenings((), None, None)})


def test_citygml_with_windows_follows_the_official_schemas(
    buildings: list[Building], gable: Building, amersfoort: Reference, found: UnitOpenings
) -> None:
    root = etree.fromstring(_gml(buildings, amersfoort, openings={gable.id: found}))
    citygml_schema().assertValid(root)
    ids = [e.get(GML_ID) for e in root.iter() if e.get(GML_ID)]
    assert len(set(ids)) == len(ids)
    assert {str(e.get(HREF))[1:] for e in root.iter() if e.get(HREF)} <= set(ids)


def test_walls_have_holes_that_their_windows_fill(gable: Building, amersfoort: Reference, found: UnitOpenings) -> None:
    house = etree.fromstring(_gml([gable], amersfoort, openings={gable.id: found})).find(".//b:Building", NS)
    assert house is not None
    assert house.findtext("b:storeysAboveGround", namespaces=NS) == "2"
    assert len(house.findall(".//b:Window", NS)) == 2
    assert len(house.findall(".//b:Door", NS)) == 1
    wall = next(w for w in house.iterfind("b:boundedBy/b:WallSurface", NS) if w.find("b:opening", NS) is not None)
    plain, holed = (wall.find(f"b:lod{n}MultiSurface//gml:Polygon", NS) for n in (2, 3))
    assert plain is not None
    assert holed is not None
    filled = [_area(p) for p in wall.iterfind("b:opening//gml:Polygon", NS)]
    assert sum(filled, start=np.zeros(3)) == pytest.approx(np.array([0, -AREA_M2, 0]), abs=1e-3)
    assert _area(holed) + sum(filled, start=np.zeros(3)) == pytest.approx(_area(plain), abs=1e-3)
    assert [e.text for e in house.iterfind(".//b:Window//g:doubleAttribute/g:value", NS)] == ["0.91", "0.91"]


SAID = {"windows": 2, "window_to_wall_ratio": 0.07, "windows_confidence": 0.91, "windows_seen_share": 0.962}
LITTLE = {"windows_missing": TOO_LITTLE, "windows_seen_share": 0.1}
UNKNOWN = {"windows_missing": "too coarse", "windows_seen_share": 0.25}


def _said(surface: etree._Element) -> dict[str, Any]:
    kinds: dict[str, Any] = {"double": float, "int": int, "string": str}
    return {
        str(a.get("name")): read(a.findtext("g:value", namespaces=NS))
        for kind, read in kinds.items()
        for a in surface.iterfind(f"g:{kind}Attribute", NS)
        if "window" in str(a.get("name"))
    }


def test_walls_say_how_much_of_them_is_windows_or_why_nobody_knows(
    gable: Building, amersfoort: Reference, found: UnitOpenings
) -> None:
    root = etree.fromstring(_gml([gable], amersfoort, openings={gable.id: found}))
    surfaces = [_said(s[0]) for s in root.iterfind(".//b:Building/b:boundedBy", NS)]
    assert [s for s in surfaces if s] == [SAID, UNKNOWN, LITTLE]
    feature = json.loads(feature_line(gable, SURVEY, openings={gable.id: found}))
    for lod in ("2.2", "3"):
        geometry = next(g for g in feature["CityObjects"][gable.id]["geometry"] if g["lod"] == lod)
        values = geometry["semantics"]["values"][0] if lod == "2.2" else geometry["semantics"]["values"]
        said = [geometry["semantics"]["surfaces"][v] for v in values]
        told = [{k: v for k, v in s.items() if "window" in k} for s in said if s["type"] != "Window"]
        assert [t for t in told if t] == [SAID, UNKNOWN, LITTLE], lod
        assert all("windows" not in s for s in said if s.get("is_party_wall"))


@pytest.mark.parametrize(
    ("source", "expected"), [({}, "2"), ({"storeys": 3}, "3"), ({"storeysAboveGround": 4.0}, "4"), ({"storeys": "two"}, "2"), ({"storeys": 2.5}, "2")]
)  # fmt: skip
def test_one_figure_of_storeys_the_source_s_own_first(
    gable: Building, amersfoort: Reference, found: UnitOpenings, source: dict[str, Any], expected: str
) -> None:
    house = etree.fromstring(_gml([gable.with_attributes(source)], amersfoort, openings={gable.id: found}))
    assert [e.text for e in house.iterfind(".//b:storeysAboveGround", NS)] == [expected]


def test_lod3_is_closed_like_the_solid(gable: Building, amersfoort: Reference, found: UnitOpenings) -> None:
    """What LoD3 refers to, its walls with holes, and their windows together have area vectors that cancel."""
    root = etree.fromstring(_gml([gable], amersfoort, openings={gable.id: found}))
    by_id = {str(p.get(GML_ID)): p for p in root.iter(f"{{{NS['gml']}}}Polygon")}
    members = root.findall(".//b:lod3MultiSurface//gml:surfaceMember", NS)
    polygons = [by_id[str(m.get(HREF))[1:]] if m.get(HREF) else m[0] for m in members]
    assert len(polygons) == len(gable.solids[Lod.LOD22].faces) + 3
    assert sum((_area(p) for p in polygons), start=np.zeros(3)) == pytest.approx(np.zeros(3), abs=1e-3)


@pytest.mark.skipif(shutil.which("citygmltest") is None, reason="needs Debian's libcitygml-bin")
def test_libcitygml_reads_windows(gable: Building, amersfoort: Reference, found: UnitOpenings, tmp_path: Path) -> None:
    (tmp_path / "a.gml").write_bytes(_gml([gable], amersfoort, openings={gable.id: found}))
    done = subprocess.run(
        ["citygmltest", "-log", str(tmp_path / "a.gml")], capture_output=True, text=True, timeout=60, check=False
    )
    said = done.stdout + done.stderr
    assert done.returncode == 0
    assert not [line for line in said.splitlines() if "error" in line.lower() or "warn" in line.lower()]


def test_cityjson_has_windows_as_children_of_walls(gable: Building, found: UnitOpenings) -> None:
    line = feature_line(gable, SURVEY, openings={gable.id: found})
    geometry = json.loads(line)["CityObjects"][gable.id]["geometry"][-1]
    assert (geometry["type"], geometry["lod"]) == ("MultiSurface", "3")
    surfaces = [geometry["semantics"]["surfaces"][v] for v in geometry["semantics"]["values"]]
    walls = [k for k, s in enumerate(surfaces) if "children" in s]
    assert [surfaces[k]["type"] for k in walls] == ["WallSurface"]
    children = surfaces[walls[0]]["children"]
    assert [surfaces[k]["type"] for k in children] == ["Window", "Window", "Door"]
    assert {surfaces[k]["parent"] for k in children} == {walls[0]}
    holes = geometry["boundaries"][walls[0]][1:]
    assert [sorted(h) for h in holes] == [sorted(geometry["boundaries"][k][0]) for k in children]
    assert holes[0] == geometry["boundaries"][children[0]][0][::-1]


def test_a_line_with_windows_read_again_is_the_same_building(
    buildings: list[Building], gable: Building, found: UnitOpenings
) -> None:
    for building in buildings:
        again = read_feature(feature_line(building, SURVEY, openings={gable.id: found}), SURVEY)
        assert feature_line(again, SURVEY) == feature_line(building, SURVEY)


@pytest.fixture
def lines(gable: Building, local: Reference, found: UnitOpenings) -> list[bytes]:
    return [header_line(local, extent_of([gable]), SURVEY), feature_line(gable, SURVEY, openings={gable.id: found})]


def test_cityjson_with_windows_follows_the_schema(lines: list[bytes]) -> None:
    schemas = [json.loads(path.read_text()) for path in sorted(SCHEMAS.glob("*.schema.json"))]
    registry = jsonschema_rs.Registry([(schema["$id"], schema) for schema in schemas])
    schema = next(s for s in schemas if s["$id"].endswith("/cityjsonfeature.schema.json"))
    jsonschema_rs.validator_for(schema, registry=registry).validate(json.loads(lines[1]))


def test_cjio_finds_the_windows(lines: list[bytes], cjio: ModuleType, gable: Building, tmp_path: Path) -> None:
    (tmp_path / "city.json").write_bytes(document(lines))
    with open(tmp_path / "city.json", encoding="utf-8") as file:
        city = cjio.reader(file, ignore_duplicate_keys=False)
    city.check_version()
    assert city.remove_orphan_vertices() == 0
    city.filter_lod("3")
    said = city.get_info(long=True)
    assert "LoD = ['3']" in said
    assert "semantics surfaces = ['Door', 'GroundSurface', 'RoofSurface', 'WallSurface', 'Window']" in said
    assert city.get_bbox()[:3] == pytest.approx(gable.solids[Lod.LOD22].vertices.min(axis=0), abs=1e-4)


def _area(polygon: etree._Element) -> np.ndarray:
    """Area vector of a polygon with its holes."""
    rings = [
        np.array((e.text or "").split(), float).reshape(-1, 3)[:-1] for e in polygon.iter(f"{{{NS['gml']}}}posList")
    ]
    return np.asarray(
        np.sum([np.cross(r - r[0], np.roll(r, -1, axis=0) - r[0]).sum(axis=0) / 2 for r in rings], axis=0)
    )
