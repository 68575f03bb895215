"""Triangles of two tetrahedra meet exactly where the solids share a part of their volume but not the whole of one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from cityflow.core.building import Polyhedron
from cityflow.geometry.polygon_overlap import overlap_volume
from cityflow.geometry.polyhedron import triangulate, volume
from cityflow.geometry.self_intersection import meeting_groups, triangles_meet
from geometry_shapes import polyhedron


def tetrahedron(points: NDArray[np.float64]) -> Polyhedron:
    if np.linalg.det(points[1:] - points[0]) < 0:
        points = points[[1, 0, 2, 3]]
    return polyhedron(points, [((0, 2, 1),), ((0, 1, 3),), ((1, 2, 3),), ((2, 0, 3),)])


def surfaces_meet(a: Polyhedron, b: Polyhedron) -> bool:
    one, two = triangulate(a), triangulate(b)
    vertices = np.concatenate([one.vertices, two.vertices])
    triangles = np.concatenate([one.triangles, two.triangles + len(one.vertices)])
    groups = np.repeat([0, 1], [len(one.triangles), len(two.triangles)])
    return bool(meeting_groups(vertices, triangles, groups, 1e-9, 1) == [(0, 1)])


def test_meeting_surfaces_are_told_from_volumes() -> None:
    rng = np.random.default_rng(5)
    seen = {"apart": 0, "inside": 0, "meet": 0}
    for _ in range(800):
        a = tetrahedron(rng.uniform(0, 10, (4, 3)))
        size = rng.choice([0.5, 3.0, 8.0])
        b = tetrahedron(a.vertices.mean(axis=0) + size * rng.normal(size=3) / 2 + rng.uniform(-size, size, (4, 3)))
        common, least = overlap_volume(a, b), min(volume(a), volume(b))
        if common < 1e-9:
            kind = "apart"
        elif common > least * (1 - 1e-9):
            kind = "inside"
        else:
            kind = "meet"
        assert surfaces_meet(a, b) == (kind == "meet"), (kind, common)
        seen[kind] += 1
    assert min(seen.values()) > 20


TRIANGLE = [(0, 0, 0), (4, 0, 0), (0, 4, 0)]


@pytest.mark.parametrize(
    ("more", "two", "meet"),
    [
        ([(4, 4, 0)], (1, 3, 2), False),  # coplanar neighbours with a common edge
        ([(1, 1, 0)], (0, 1, 3), True),  # folded onto each other about a common edge
        ([(1, 1, 2)], (0, 1, 3), False),  # common edge, at an angle
        ([(-4, 0, 0), (0, -4, 0)], (0, 3, 4), False),  # coplanar, common vertex, on the other side
        ([(1, 1, 0), (3, 3, 0)], (0, 3, 4), True),  # coplanar, common vertex, overlapping
        ([(1, 1, 3), (1, 1, -3)], (0, 3, 4), True),  # common vertex, pierced
        ([(1, 1, 3), (2, 1, 3)], (0, 3, 4), False),  # common vertex, above
        ([(1, 1, 0), (1, 2, 3), (2, 1, 3)], (3, 4, 5), True),  # vertex on the face
        ([(2, 0, 0), (1, -2, 3), (3, -2, 3)], (3, 4, 5), True),  # vertex on an edge
        ([(1, 1, 1e-4), (1, 2, 3), (2, 1, 3)], (3, 4, 5), False),  # a tenth of a millimetre above
        ([(2, 0, 0), (6, 0, 0), (4, -3, 0)], (3, 4, 5), True),  # coplanar, edges overlap in part
        ([], (0, 1, 2), True),  # the same triangle
    ],
)
def test_pairs_of_triangles(more: list[tuple[float, float, float]], two: tuple[int, int, int], meet: bool) -> None:
    vertices = np.array([*TRIANGLE, *more], np.float64)
    for turned in (two, two[::-1], (two[1], two[2], two[0])):
        first, second = np.array([0, 1, 2]), np.array(turned)
        assert triangles_meet(vertices, first, second, 1e-6) == meet
        assert triangles_meet(vertices, second, first, 1e-6) == meet
