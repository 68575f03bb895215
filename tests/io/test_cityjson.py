from __future__ import annotations

import json
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from cityflow.core.building import Building, Face, Lod, Polyhedron, Semantic, Status
from cityflow.io.city_models.cityjson import ORIGIN, Transform, feature_line, read_feature

SURVEY = Transform(84000, 447000, 0)


def assert_same_solid(a: Polyhedron, b: Polyhedron) -> None:
    assert [(f.semantic, f.plane, f.neighbour) for f in a.faces] == [
        (f.semantic, f.plane, f.neighbour) for f in b.faces
    ]
    for f, g in zip(a.faces, b.faces, strict=True):
        assert len(f.rings) == len(g.rings)
        for ring_f, ring_g in zip(f.rings, g.rings, strict=True):
            assert a.ring(ring_f).tobytes() == b.ring(ring_g).tobytes()


@pytest.mark.parametrize("transform", [ORIGIN, SURVEY])
def test_a_line_read_again_is_the_same_building(buildings: list[Building], transform: Transform) -> None:
    for building in buildings:
        line = feature_line(building, transform)
        again = read_feature(line, transform)
        assert again.solids.keys() == building.solids.keys()
        for lod, solid in building.solids.items():
            assert_same_solid(solid, again.solids[lod])
        assert again.footprint.equals_exact(building.footprint, 0.0)
        assert (again.id, again.status, again.reason) == (building.id, building.status, building.reason)
        assert again.ground_height == building.ground_height
        assert repr(again.planes) == repr(building.planes)
        assert feature_line(again, transform) == line


def test_attributes_survive_in_order_with_noise_removed(gable: Building) -> None:
    attributes = read_feature(feature_line(gable)).attributes
    assert list(attributes) == list(gable.attributes)
    assert attributes["nmad_m"] == 0.3
    assert attributes["identificatiebagpnd"] == 503100000018603
    assert attributes["inonderzoek"] is False
    assert attributes["hoek"] is None
    assert attributes['Größe <m²> & "mehr"'] == "ä<&>\ufffd'\""


def test_own_status_stands_beside_the_sources(courtyard: Building) -> None:
    attributes = json.loads(feature_line(courtyard))["CityObjects"][courtyard.id]["attributes"]
    assert attributes["status"] == "bestaand"
    assert attributes["cityflow_status"] == "degraded"
    assert attributes["cityflow_reason"] == courtyard.reason


def test_surfaces_tell_planes_and_party_walls(gable: Building) -> None:
    geometry = json.loads(feature_line(gable))["CityObjects"][gable.id]["geometry"]
    assert [(g["type"], g["lod"]) for g in geometry] == [
        ("MultiSurface", "0"),
        ("Solid", "1.2"),
        ("Solid", "1.3"),
        ("Solid", "2.2"),
    ]
    surfaces = {json.dumps(s): s for s in geometry[3]["semantics"]["surfaces"]}.values()
    party = [s for s in surfaces if s.get("is_party_wall")]
    assert party == [{"type": "WallSurface", "is_party_wall": True, "neighbour": "NL <x> é"}]
    south, north = (s for s in surfaces if s["type"] == "RoofSurface")
    # a plane rising northwards falls to the south; (7.5 − 4.0101) / 4 is 41.104°
    assert (south["aspect_deg"], north["aspect_deg"]) == (180.0, 0.0)
    assert south["slope_deg"] == pytest.approx(41.104, abs=1e-3)
    assert (south["points"], south["rmse"]) == (612, 0.0312)
    assert "rmse" not in north


def test_equal_vertices_of_two_solids_are_stored_once(gable: Building) -> None:
    vertices = json.loads(feature_line(gable))["vertices"]
    # 4 on the ground, 4 eaves, 2 of the ridge, 4 of each flat top
    assert len(vertices) == len({tuple(v) for v in vertices}) == 18


def test_vertices_that_coincide_within_a_solid_stay_apart() -> None:
    """Two cubes that touch in a corner are one shell only as long as the corner is there twice."""
    faces = (
        Face(((0, 1, 2),), Semantic.ROOF),
        Face(((3, 4, 5),), Semantic.ROOF),
    )
    xyz = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [-1, 0, 0], [0, -1, 0]], float)
    building = replace(_bare(), solids={Lod.LOD22: Polyhedron(xyz, faces)})
    assert read_feature(feature_line(building)).solids[Lod.LOD22].vertices.tobytes() == xyz.tobytes()


def test_numbers_of_numpy_are_numbers(gable: Building) -> None:
    integer, real, truth = (cast(Any, kind) for kind in (np.int64, np.float32, np.bool_))
    solid = gable.solids[Lod.LOD22]
    faces = tuple(
        replace(f, plane=integer(f.plane), rings=tuple(tuple(np.array(r)) for r in f.rings)) for f in solid.faces
    )
    odd = replace(
        gable,
        solids={**gable.solids, Lod.LOD22: Polyhedron(solid.vertices, faces)},
        planes=(replace(gable.planes[0], points=integer(612), slope_x=real(0)), gable.planes[1]),
        attributes={**gable.attributes, "ridge_height": real(7.5), "inonderzoek": truth(False)},
        ground_height=np.float64(gable.ground_height),
    )
    assert feature_line(odd) == feature_line(gable)


def _bare() -> Building:
    return Building("x", Polygon(), 0.0, {}, status=Status.FAILED)


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(*[st.integers(-9_999_999_999, 99_999_999_999) for _ in range(3)]), min_size=3, max_size=3, unique=True
    )
)
def test_every_multiple_of_a_tenth_of_a_millimetre_is_exact(tenths: list[tuple[int, int, int]]) -> None:
    world = np.array([[float(f"{t}e-4") for t in point] for point in tenths])
    for transform in (ORIGIN, SURVEY, Transform(-7_000, 12_345_000, 50)):
        assert transform.decode(transform.encode(world)).tobytes() == world.tobytes()


def test_no_line_contains_a_line_break(buildings: list[Building]) -> None:
    for building in buildings:
        assert len(feature_line(building).decode().splitlines()) == 1
