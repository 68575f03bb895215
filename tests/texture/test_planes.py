"""Faces in planes of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.texture.planes import face_planes
from texture_scenes import GROUND, X, Y, house


def test_roof_and_walls_have_planes_and_the_ground_has_none() -> None:
    faces = face_planes(house(0, 0, 10, 8, 6), None)
    assert [f.key for f in faces] == [("solid", k) for k in range(1, 6)]
    assert [round(f.polygon.area, 6) for f in faces] == [80, 60, 48, 60, 48]


def test_frames_are_right_handed_and_walls_stand_upright() -> None:
    for face in face_planes(house(0, 0, 10, 8, 6), None):
        assert np.allclose(np.cross(face.right, face.up), face.normal)
        expected = (0, 1, 0) if face.semantic is Semantic.ROOF else (0, 0, 1)
        assert np.allclose(face.up, expected)
    south = face_planes(house(0, 0, 10, 8, 6), None)[1]
    assert np.allclose(south.normal, (0, -1, 0))
    assert np.allclose(south.right, (1, 0, 0))


def test_vertices_come_back_from_the_plane_in_national_coordinates() -> None:
    for face in face_planes(house(0, 0, 10.1234, 8, 6), None):
        for ring in face.rings:
            assert np.abs(face.world(face.on_plane(ring)) - ring).max() < 1e-6
        assert np.abs(np.array(face.polygon.bounds)).max() < 20


def _single(ring: list[tuple[float, float, float]], semantic: Semantic = Semantic.ROOF) -> Polyhedron:
    return Polyhedron(np.array(ring) + np.array([X, Y, GROUND]), (Face((tuple(range(len(ring))),), semantic),))


def test_a_sloping_roof_climbs_along_t() -> None:
    (face,) = face_planes(_single([(0, 0, 0), (10, 0, 0), (10, 4, 3), (0, 4, 3)]), None)
    assert np.allclose(face.up, (0, 0.8, 0.6))
    assert np.allclose(face.normal, (0, -0.6, 0.8))
    assert np.allclose(np.array(face.polygon.bounds), (-5, -2.5, 5, 2.5))


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (1e-4, 0.0), (0.02, -0.03)])
def test_of_nearly_level_roofs_north_is_up(tilt: tuple[float, float]) -> None:
    (face,) = face_planes(_single([(0, 0, 0), (10, 0, tilt[0]), (10, 8, tilt[0] + tilt[1]), (0, 8, tilt[1])]), None)
    assert face.up[1] > 0.9999


def test_an_outer_ceiling_is_seen_from_below() -> None:
    (face,) = face_planes(_single([(0, 0, 0), (0, 1, 0), (10, 1, 0), (10, 0, 0)], Semantic.OUTER_CEILING), None)
    assert np.allclose(face.normal, (0, 0, -1))
    assert np.allclose(np.cross(face.right, face.up), face.normal)


def test_party_walls_slivers_and_lines_have_none() -> None:
    box = house(0, 0, 10, 8, 6)
    party = Polyhedron(box.vertices, tuple(replace(f, neighbour="b") if k == 2 else f for k, f in enumerate(box.faces)))
    assert ("solid", 2) not in {f.key for f in face_planes(party, None)}
    assert not face_planes(_single([(0, 0, 0), (10, 0, 0), (10, 1e-6, 0), (0, 1e-6, 0)]), None)
    assert not face_planes(_single([(0, 0, 0), (10, 0, 0), (5, 0, 0)]), None)


def test_a_sliver_has_the_normal_of_its_area() -> None:
    (face,) = face_planes(_single([(0, 0, 0), (10, 0, 0.0001), (10, 0.0002, 0), (0, 0.0002, 0)]), None)
    assert abs(face.polygon.area - np.hypot(0.002, 0.0005)) < 2e-4


def test_holes_are_holes_and_bow_ties_leave_their_greater_part() -> None:
    corners = [(0, 0, 0), (10, 0, 0), (10, 8, 0), (0, 8, 0), (4, 4, 0), (4, 6, 0), (6, 6, 0), (6, 4, 0)]
    vertices = np.array(corners, float) + np.array([X, Y, GROUND])
    (face,) = face_planes(Polyhedron(vertices, (Face(((0, 1, 2, 3), (4, 5, 6, 7)), Semantic.ROOF),)), None)
    assert face.polygon.area == pytest.approx(76)
    (tie,) = face_planes(_single([(0, 0, 0), (10, 0, 0), (10, 8, 0), (8, -2, 0)]), None)
    assert tie.polygon.is_valid
    assert tie.polygon.area > 1


def test_overhangs_follow_the_solid() -> None:
    beyond = _single([(0, -1, 5), (10, -1, 5), (10, 0, 5), (0, 0, 5)])
    assert face_planes(house(0, 0, 10, 8, 6), beyond)[-1].key == ("beyond", 0)
