"""Rules of surfaces that are no closed shell: polygons each by itself, and open surfaces in a piece."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.geometry.polyhedron import rings_of
from cityflow.geometry.validity import check_polygons, check_polyhedron, check_surface
from geometry_shapes import gable


def triangle(*corners: tuple[float, float, float]) -> list[FloatArray]:
    return [np.array(corners)]


LEFT = triangle((0, 0, 0), (4, 0, 0), (0, 4, 1))
RIGHT = triangle((4, 0, 0), (4, 4, 2), (0, 4, 1))


def codes(polygons: list[list[FloatArray]]) -> list[int]:
    return [fault.code for fault in check_surface(polygons)]


def test_two_triangles_with_a_common_edge_are_a_surface() -> None:
    assert codes([LEFT, RIGHT]) == []
    assert [f.code for f in check_surface([LEFT, RIGHT], closed=True)] == [301]


def test_a_surface_is_in_a_piece_and_turned_alike() -> None:
    apart = triangle((9, 9, 0), (10, 9, 0), (9, 10, 0))
    assert codes([LEFT, apart]) == [305]
    assert 307 in codes([LEFT, [RIGHT[0][::-1]]])


def test_two_parts_that_touch_in_a_vertex_are_no_surface() -> None:
    assert 303 in codes([LEFT, triangle((4, 0, 0), (8, 0, 0), (8, 4, 0))])


def test_a_third_triangle_on_an_edge_is_one_too_many() -> None:
    assert 303 in codes([LEFT, RIGHT, triangle((4, 0, 0), (3, 3, 9), (0, 4, 1))])


def test_polygons_are_judged_each_by_itself() -> None:
    near = triangle((0, 0, 0), (0.0005, 0, 0), (4, 0, 0), (0, 4, 1))
    assert check_polygons([LEFT, RIGHT, LEFT]) == []
    assert [f.code for f in check_polygons([LEFT, near])] == [102]
    assert [f.code for f in check_polygons([triangle((0, 0, 0), (4, 0, 0), (np.nan, 4, 1))])] == [901]
    assert [f.code for f in check_polygons([])] == [902]


def test_a_solids_faces_without_their_shared_vertices_are_the_same_solid() -> None:
    solid = gable()
    assert check_polyhedron(solid) == []
    assert check_surface(rings_of(solid), closed=True) == []
    assert 302 in [f.code for f in check_surface(rings_of(solid)[1:], closed=True)]
    assert check_surface(rings_of(solid)[1:]) == []
