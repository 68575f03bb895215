from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.geometry.polyhedron import (
    bounds_3d,
    face_area_vectors,
    face_areas,
    face_normals,
    face_plane,
    triangulate,
    volume,
)
from geometry_shapes import L_SHAPE, SQUARE, VALID, YARD, box, extrude, gable, noded, tower_on_roof

RD = np.array([85123.4567, 447891.2345, 3.21])


def moved(solid: Polyhedron, seed: int) -> Polyhedron:
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    return Polyhedron(solid.vertices @ turn.T + RD, solid.faces)


@pytest.mark.parametrize(
    ("solid", "expected"),
    [
        (box(), 1000.0),
        (gable(8, 12, 3, 6), 8 * 12 * (3 + 1.5)),
        (extrude([L_SHAPE], 0, 5), 64 * 5),
        (extrude([SQUARE, YARD], 0, 5), 84 * 5),
        (tower_on_roof(), 500 + 64),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_volume_is_exact_wherever_the_solid_stands(solid: Polyhedron, expected: float, seed: int) -> None:
    assert volume(solid) == pytest.approx(expected, rel=1e-12)
    assert volume(moved(solid, seed)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", VALID)
def test_volume_and_area_agree_with_trimesh(name: str) -> None:
    mesh = triangulate(noded(VALID[name]))
    reference = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    assert reference.is_watertight
    assert volume(VALID[name]) == pytest.approx(reference.volume, rel=1e-6)
    assert face_areas(VALID[name]).sum() == pytest.approx(reference.area, rel=1e-5)


@pytest.mark.parametrize("name", VALID)
def test_area_vectors_of_a_closed_shell_cancel(name: str) -> None:
    assert np.allclose(face_area_vectors(moved(VALID[name], 7)).sum(axis=0), 0, atol=1e-6)


def test_triangles_of_a_face_point_the_way_of_the_face() -> None:
    solid = moved(tower_on_roof(), 3)
    mesh, normals = triangulate(solid), face_normals(solid)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals[mesh.faces])
    assert turned.min() > 0


def test_plane_of_a_roof_face() -> None:
    solid = gable(8, 12, 3, 6)
    normal, offset = face_plane(solid, 6)
    assert normal == pytest.approx(np.array([0.6, 0, 0.8]))
    assert offset == pytest.approx(0.6 * 8 + 0.8 * 3)


def test_bounds_look_at_used_vertices_only() -> None:
    solid = box()
    stray = Polyhedron(np.vstack([solid.vertices, [[99.0, 99.0, 99.0]]]), solid.faces)
    low, high = bounds_3d(stray)
    assert low.tolist() == [0, 0, 0]
    assert high.tolist() == [10, 10, 10]


def test_a_face_without_area_has_no_normal() -> None:
    line = Polyhedron(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), (Face(((0, 1, 2),), Semantic.WALL),))
    assert np.isnan(face_normals(line)).all()
    assert face_areas(line).tolist() == [0.0]
