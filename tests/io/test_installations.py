"""What is fixed to a building, in every format."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import jsonschema_rs
import numpy as np
import pytest
from lxml import etree

from cityflow.core.building import Building, Face, Installation, Lod, Polyhedron, Semantic
from cityflow.core.reference import Reference
from cityflow.io.city_models.appearance import BARE
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.cityjson_sequence import header_line, join
from cityflow.io.city_models.gltf_surfaces import UNTEXTURED, surfaces_of
from cityflow.io.city_models.obj import write_obj
from citygml_schema import citygml_schema

CORNERS = np.array([[0, 0, 3.0], [3, 0, 3], [3, -1.4, 3], [0, -1.4, 3], [3, -1.4, 4.2], [0, -1.4, 4.2]])


@pytest.fixture
def balcony(gable: Building) -> Building:
    """A gabled house with a front and an underside of a balcony."""
    x, y = np.asarray(gable.footprint.exterior.coords)[0]
    faces = (
        Face(((3, 2, 4, 5),), Semantic.WALL, points=120),
        Face(((3, 0, 1, 2),), Semantic.OUTER_CEILING, points=0),
    )
    one = Installation(
        "balcony", Polyhedron(np.round(CORNERS + np.array([round(x), round(y), gable.ground_height]), 4), faces), 120
    )
    return replace(gable, installations=(one,))


def test_cityjson_gives_it_back_as_a_child_of_its_building(
    balcony: Building, amersfoort: Reference, schema_of: dict[str, jsonschema_rs.Validator]
) -> None:
    line = feature_line(balcony)
    feature = json.loads(line)
    schema_of["CityJSONFeature"].validate(feature)
    name = f"{balcony.id}-balcony-1"
    assert feature["CityObjects"][balcony.id]["children"] == [name]
    child = feature["CityObjects"][name]
    assert (child["type"], child["parents"]) == ("BuildingInstallation", [balcony.id])
    (back,), (given,) = read_feature(line).installations, balcony.installations
    assert (back.kind, back.points, back.surfaces.faces) == (given.kind, given.points, given.surfaces.faces)
    assert np.array_equal(back.surfaces.vertices, given.surfaces.vertices)
    header = header_line(amersfoort)
    there, again = list(join([[header_line(amersfoort), feature_line(balcony)]], header))
    assert there == header
    assert json.loads(again)["CityObjects"].keys() == feature["CityObjects"].keys()


def test_without_one_a_line_is_as_ever(gable: Building) -> None:
    objects = json.loads(feature_line(gable))["CityObjects"]
    assert objects.keys() == {gable.id}
    assert "children" not in objects[gable.id]


def test_citygml_has_an_outer_installation_with_surfaces(balcony: Building, amersfoort: Reference) -> None:
    buffer = io.BytesIO()
    write_citygml(buffer, [balcony], amersfoort)
    document = etree.fromstring(buffer.getvalue())
    schema = citygml_schema()
    assert schema.validate(document), schema.error_log
    space = {"b": "http://www.opengis.net/citygml/building/2.0", "g": "http://www.opengis.net/gml"}
    (one,) = document.findall(".//b:outerBuildingInstallation/b:BuildingInstallation", space)
    assert one.findtext("b:function", namespaces=space) == "1000"
    polygons = {f"#{p.get('{http://www.opengis.net/gml}id')}" for p in one.iterfind(".//g:Polygon", space)}
    links = {
        m.get("{http://www.w3.org/1999/xlink}href") for m in one.iterfind("b:lod3Geometry//g:surfaceMember", space)
    }
    assert len(polygons) == 2
    assert links == polygons


def test_obj_and_gltf_show_its_faces_without_a_texture(balcony: Building, amersfoort: Reference) -> None:
    bare = replace(balcony, installations=())
    files = [
        write_obj("a", [b], amersfoort, Transform.over(b.footprint.bounds))["a.obj"].decode() for b in (bare, balcony)
    ]
    assert files[1].count("\nv ") == files[0].count("\nv ") + len(CORNERS)
    assert files[1].count("usemtl outer_ceiling") == files[0].count("usemtl outer_ceiling") + 1
    before, after = (surfaces_of([b], BARE, Lod.LOD22) for b in (bare, balcony))
    assert len(after.rows) == len(before.rows) + 2
    assert after.page[-2:].tolist() == [UNTEXTURED, UNTEXTURED]
    assert len(surfaces_of([balcony], BARE, Lod.LOD12).rows) == len(surfaces_of([bare], BARE, Lod.LOD12).rows)


def test_a_dormer_is_drawn_by_its_solid_alone_and_has_no_code(balcony: Building, amersfoort: Reference) -> None:
    dormer = replace(balcony, installations=(replace(balcony.installations[0], kind="dormer"),))
    bare = replace(balcony, installations=())
    files = [write_obj("a", [b], amersfoort, Transform.over(b.footprint.bounds))["a.obj"] for b in (bare, dormer)]
    assert files[0] == files[1]
    assert surfaces_of([bare], BARE, Lod.LOD22).rows == surfaces_of([dormer], BARE, Lod.LOD22).rows
    (back,) = read_feature(feature_line(dormer)).installations
    assert back.kind == "dormer"
    buffer = io.BytesIO()
    write_citygml(buffer, [dormer], amersfoort)
    document = etree.fromstring(buffer.getvalue())
    schema = citygml_schema()
    assert schema.validate(document), schema.error_log
    (function,) = document.iterfind(".//{*}BuildingInstallation/{*}function")
    assert function.text == "dormer"
    assert function.get("codeSpace") is None
