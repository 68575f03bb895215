from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from cityflow.core.building import Building, Lod, Status
from cityflow.core.reference import Reference
from cityflow.io.city_models.citygml import Tin, srs_name, write_citygml
from cityflow.io.city_models.cityjson_sequence import extent_of
from cityflow.io.crs import resolve
from citygml_schema import citygml_schema

NS = {
    "c": "http://www.opengis.net/citygml/2.0",
    "b": "http://www.opengis.net/citygml/building/2.0",
    "d": "http://www.opengis.net/citygml/relief/2.0",
    "g": "http://www.opengis.net/citygml/generics/2.0",
    "gml": "http://www.opengis.net/gml",
}
GML_ID = f"{{{NS['gml']}}}id"
HREF = "{http://www.w3.org/1999/xlink}href"


@pytest.fixture(scope="module")
def schema() -> etree.XMLSchema:
    return citygml_schema()


@pytest.fixture
def model(buildings: list[Building], terrain: tuple[np.ndarray, np.ndarray], amersfoort: Reference) -> bytes:
    return _written(buildings, amersfoort, [("terrain 340_1790", *terrain)], "Delft <é> & more")


def _written(
    buildings: list[Building], reference: Reference, terrain: list[Tin] | None = None, title: str = ""
) -> bytes:
    target = io.BytesIO()
    write_citygml(target, buildings, reference, extent_of(buildings), terrain or [], title)
    return target.getvalue()


def test_it_follows_the_official_schemas(model: bytes, schema: etree.XMLSchema) -> None:
    schema.assertValid(etree.fromstring(model))


def test_the_schemas_do_refuse(model: bytes, schema: etree.XMLSchema) -> None:
    assert not schema.validate(etree.fromstring(model.replace(b"bldg:lod2Solid", b"bldg:lod2Solidus")))
    assert not schema.validate(etree.fromstring(model.replace(b'gml:id="b-', b'gml:id="5 ')))


@pytest.mark.skipif(shutil.which("citygmltest") is None, reason="needs Debian's libcitygml-bin")
def test_libcitygml_reads_it(model: bytes, tmp_path: Path) -> None:
    returned, said = _citygmltest(tmp_path, model)
    assert returned == 0
    assert not [line for line in said.splitlines() if "error" in line.lower() or "warn" in line.lower()]
    assert _citygmltest(tmp_path, model.replace(b"</bldg:Building>", b"", 1))[0] != 0


def _citygmltest(folder: Path, model: bytes) -> tuple[int, str]:
    (folder / "tile.gml").write_bytes(model)
    done = subprocess.run(
        ["citygmltest", "-log", str(folder / "tile.gml")], capture_output=True, text=True, timeout=60, check=False
    )
    return done.returncode, done.stdout + done.stderr


def test_the_terrain_is_whole(model: bytes, terrain: tuple[np.ndarray, np.ndarray]) -> None:
    root = etree.fromstring(model)
    rings = [_ring(e) for e in root.iterfind(".//d:tin//gml:posList", NS)]
    vertices, triangles = terrain
    assert np.array_equal(np.array(rings)[:, :3], vertices[triangles])
    assert np.array_equal(np.array(rings)[:, 0], np.array(rings)[:, 3])


def test_every_polygon_of_the_solid_is_one_of_the_boundary_surfaces(model: bytes) -> None:
    for building in etree.fromstring(model).iterfind(".//b:Building", NS):
        links = [str(e.get(HREF)) for e in building.iterfind("b:lod2Solid//gml:surfaceMember", NS)]
        bounding = [f"#{e.get(GML_ID)}" for e in building.iterfind("b:boundedBy//gml:Polygon", NS)]
        assert sorted(links) == sorted(bounding)
        assert len(set(links)) == len(links)


def test_the_surfaces_enclose_the_volume_of_the_solid(model: bytes, gable: Building) -> None:
    """Signed volume over the exterior and interior rings as a foreign reader finds them."""
    root = etree.fromstring(model)
    house, block = root.findall(".//b:Building", NS)[:2]
    prism, gable_end = 10 * 8 * (4.0101 + 1.2345), 10 * 8 * (7.5 - 4.0101) / 2
    assert _volume(house, "b:boundedBy") == pytest.approx(prism + gable_end, abs=1e-6)
    assert _volume(house, "b:lod1Solid") == pytest.approx(10 * 8 * (5.5 + 1.2345), abs=1e-6)
    assert _volume(block, "b:boundedBy") == pytest.approx((400 - 64) * (9.8765 + 1.2345), abs=1e-6)


def test_semantics_attributes_and_party_walls_are_told(model: bytes, gable: Building) -> None:
    house = etree.fromstring(model).find(".//b:Building", NS)
    assert house is not None
    assert house.findtext("gml:name", namespaces=NS) == gable.id
    assert house.findtext("b:roofType", namespaces=NS) == "1030"
    assert float(house.findtext("b:measuredHeight", namespaces=NS) or 0) == pytest.approx(7.5 + 1.2345)
    said = dict(_generic(house))
    assert said["identificatiebagpnd"] == "503100000018603"
    assert said['Größe <m²> & "mehr"'] == "ä<&>\ufffd'\""
    assert said["nmad_m"] == "0.3"
    assert said["inonderzoek"] == "false"
    assert said["cityflow_status"] == "done"
    assert "hoek" not in said
    kinds = [etree.QName(e[0]).localname for e in house.iterfind("b:boundedBy", NS)]
    assert kinds == [
        "GroundSurface",
        "WallSurface",
        "WallSurface",
        "WallSurface",
        "WallSurface",
        "RoofSurface",
        "RoofSurface",
    ]
    party = [dict(_generic(e)) for e in house.iterfind("b:boundedBy/b:WallSurface", NS)]
    assert party[1] == {"is_party_wall": "true", "neighbour": "NL <x> é"}
    assert party[0] == party[2] == party[3] == {}


def test_roof_faces_of_one_plane_are_one_surface(amersfoort: Reference, gable: Building) -> None:
    solid = gable.solids[Lod.LOD22]
    same_plane = replace(solid, faces=tuple(replace(f, plane=0) if f.plane == 1 else f for f in solid.faces))
    root = etree.fromstring(_written([replace(gable, solids={Lod.LOD22: same_plane})], amersfoort))
    roofs = root.findall(".//b:RoofSurface", NS)
    assert [len(r.findall(".//gml:Polygon", NS)) for r in roofs] == [2]


def test_hostile_ids_stay_apart(amersfoort: Reference, gable: Building, schema: etree.XMLSchema) -> None:
    ids = ["a b", "a_x20_b", "a-b", "1", "b-1", "", ":", "é", "\u2028", "x" * 300]
    root = etree.fromstring(_written([replace(gable, id=i) for i in ids], amersfoort))
    schema.assertValid(root)
    assert len({e.get(GML_ID) for e in root.iter() if e.get(GML_ID)}) == sum(1 for e in root.iter() if e.get(GML_ID))


@pytest.mark.parametrize(
    ("code", "urn"),
    [
        ("EPSG:7415", "urn:ogc:def:crs,crs:EPSG::28992,crs:EPSG::5709"),
        ("EPSG:25833", "urn:ogc:def:crs:EPSG::25833"),
        ("local", ""),
    ],
)
def test_the_envelope_names_the_crs(gable: Building, code: str, urn: str) -> None:
    envelope = etree.fromstring(_written([gable], resolve(code))).find("gml:boundedBy/gml:Envelope", NS)
    assert envelope is not None
    assert srs_name(resolve(code)) == urn
    assert envelope.get("srsName", "") == urn
    assert envelope.findtext("gml:lowerCorner", namespaces=NS) == "84967.5731 447497.4452 -1.2345"


def test_it_streams_and_repeats_itself(gable: Building, amersfoort: Reference) -> None:
    target = io.BytesIO()

    def one_after_the_other() -> Iterator[Building]:
        yield gable
        assert gable.id.encode() in target.getvalue()
        yield gable

    write_citygml(target, one_after_the_other(), amersfoort)
    assert target.getvalue() == _twice(gable, amersfoort)


def _twice(gable: Building, reference: Reference) -> bytes:
    target = io.BytesIO()
    write_citygml(target, [gable, gable], reference)
    return target.getvalue()


def _ring(element: etree._Element) -> np.ndarray:
    return np.array((element.text or "").split(), float).reshape(-1, 3)


def _generic(element: etree._Element) -> Iterator[tuple[str, str]]:
    for attribute in element.iterfind(".//g:*[@name]", NS) if element.tag.endswith("Surface") else element:
        if attribute.get("name") is not None:
            yield str(attribute.get("name")), str(attribute[0].text)


def _volume(building: etree._Element, path: str) -> float:
    """Sum of the tetrahedra from the first vertex over fans of every ring; holes turn the other way and subtract."""
    total, origin = 0.0, None
    for element in building.iterfind(f"{path}//gml:posList", NS):
        ring = _ring(element)
        origin = ring[0] if origin is None else origin
        a, b, c = ring[0] - origin, ring[1:-2] - origin, ring[2:-1] - origin
        total += float(np.einsum("j,ij->i", a, np.cross(b, c)).sum()) / 6
    return total


def test_a_unit_without_geometry_still_says_why(model: bytes, buildings: list[Building]) -> None:
    assert buildings[3].status is Status.REFUSED
    last = etree.fromstring(model).findall(".//b:Building", NS)[3]
    assert dict(_generic(last))["cityflow_reason"] == "outline has no area"
    assert last.find(".//gml:Polygon", NS) is None
