"""Solids less prisms and with others added."""

from __future__ import annotations

import io

import numpy as np
import pytest
import shapely

from cityflow.core.building import Building, Lod, Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_normals, volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.obj import write_obj
from cityflow.io.crs import resolve
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.voids.carve import Prism, carve

OUTLINE = shapely.box(85_000.1234567, 447_000.0, 85_020.0, 447_012.0)
BLOCK = extrude(OUTLINE, 5.0, 17.0)
ARCADE = Prism(shapely.box(84_999.5, 446_999.5, 85_020.5, 447_003.0), 4.0, 8.3)
PASSAGE = Prism(shapely.box(85_010.0, 446_999.4, 85_013.0, 447_012.5), 4.0, 8.3)
LOGGIA = Prism(shapely.box(85_005.0, 447_010.4, 85_008.4, 447_012.5), 8.3, 11.3)
BAY = Prism(shapely.box(85_014.0, 446_998.8, 85_017.0, 447_000.1), 9.0, 15.0)
WIDTH = 85_020.0 - 85_000.1234567


@pytest.fixture(scope="module")
def carved() -> Polyhedron:
    made = carve(BLOCK, [ARCADE, PASSAGE, LOGGIA], [BAY])
    assert made is not None
    return made


def test_the_volume_is_exact(carved: Polyhedron) -> None:
    assert check_polyhedron(carved) == []
    less = 3.3 * (3.0 * WIDTH + 9.0 * 3.0) + 3.0 * 3.4 * 1.6
    assert volume(carved) == pytest.approx(volume(BLOCK) - less + 3.0 * 1.2 * 6.0, abs=0.01)


def test_faces_are_whole_and_know_what_they_are(carved: Polyhedron) -> None:
    ceilings = carved.of_semantic(Semantic.OUTER_CEILING)
    assert len(ceilings) == 3, "the arcade with the passage, the loggia, the bay"
    assert len(carved.of_semantic(Semantic.OUTER_FLOOR)) == 1
    assert len(carved.of_semantic(Semantic.ROOF)) == 2
    assert len(carved.of_semantic(Semantic.GROUND)) == 2, "the passage parts it"
    normals = face_normals(carved)
    for face, normal in zip(carved.faces, normals, strict=True):
        up = {Semantic.OUTER_CEILING: -1, Semantic.GROUND: -1, Semantic.WALL: 0}.get(face.semantic, 1)
        assert normal[2] == pytest.approx(up, abs=1e-4)


def test_vertices_that_stay_are_the_same_bit_for_bit(carved: Polyhedron) -> None:
    kept = {tuple(v) for v in carved.vertices.tolist()}
    above = {tuple(v) for v in BLOCK.vertices.tolist() if v[2] == 17.0}
    assert above <= kept


def test_the_same_prisms_give_the_same_bytes(carved: Polyhedron) -> None:
    again = carve(BLOCK, [ARCADE, PASSAGE, LOGGIA], [BAY])
    assert again is not None
    assert again.faces == carved.faces
    assert np.array_equal(again.vertices, carved.vertices)


def test_voids_over_each_other_are_one() -> None:
    above = LOGGIA._replace(low=8.3, high=11.3)
    below = Prism(shapely.box(85_003.0, 447_008.0, 85_012.0, 447_012.5), 4.0, 8.3)
    made = carve(BLOCK, [below, above], [])
    assert made is not None
    assert check_polyhedron(made) == []
    assert made.of_semantic(Semantic.OUTER_FLOOR) == ()
    assert volume(made) == pytest.approx(volume(BLOCK) - 9.0 * 4.0 * 3.3 - 3.4 * 1.6 * 3.0, abs=0.01)


def test_nothing_is_left_of_what_is_taken_away_as_a_whole() -> None:
    assert carve(BLOCK, [Prism(shapely.buffer(OUTLINE, 1.0, join_style="mitre"), 0.0, 20.0)], []) is None


def test_every_format_writes_outer_floors_and_ceilings(carved: Polyhedron) -> None:
    building = Building("a", OUTLINE, 5.0, {Lod.LOD22: carved})
    reference = resolve("EPSG:7415")
    buffer = io.BytesIO()
    write_citygml(buffer, [building], reference)
    gml = buffer.getvalue().decode()
    assert (gml.count("<bldg:OuterCeilingSurface"), gml.count("<bldg:OuterFloorSurface")) == (3, 1)
    again = read_feature(feature_line(building))
    assert [(f.semantic, f.points) for f in again.solids[Lod.LOD22].faces] == [
        (f.semantic, f.points) for f in carved.faces
    ]
    new = sum(f.points is not None for f in carved.faces)
    assert gml.count('name="points"') == new > 10
    obj = write_obj("a", [building], reference, Transform.over(OUTLINE.bounds))["a.obj"].decode()
    assert "usemtl outer_floor" in obj
