from __future__ import annotations

import manifold3d
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cityflow.core.building import Polyhedron
from cityflow.geometry.polygon_overlap import overlap_volume
from cityflow.geometry.polyhedron import triangulate, volume
from geometry_shapes import L_SHAPE, SQUARE, VALID, YARD, box, extrude

RD = np.array([85123.4567, 447891.2345, 3.21])


def shifted(solid: Polyhedron, by: tuple[float, float, float]) -> Polyhedron:
    return Polyhedron(solid.vertices + np.array(by), solid.faces)


def reference_volume(a: Polyhedron, b: Polyhedron) -> float:
    parts = []
    for solid in (a, b):
        mesh = triangulate(solid)
        parts.append(manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices - RD, mesh.triangles.astype(np.uint64))))
    return float((parts[0] ^ parts[1]).volume())


@pytest.mark.parametrize(
    ("by", "expected"),
    [
        ((0, 0, 0), 1000),
        ((5, 0, 0), 500),
        ((9, 9, 9), 1),
        ((10, 0, 0), 0),
        ((10, 3, 0), 0),
        ((0, 0, 10), 0),
        ((30, 0, 0), 0),
    ],
)
def test_boxes(by: tuple[float, float, float], expected: float) -> None:
    a = shifted(box(), tuple(RD))
    assert overlap_volume(a, shifted(a, by)) == pytest.approx(expected, abs=1e-6)


def test_a_solid_shares_its_whole_volume_with_itself() -> None:
    for solid in VALID.values():
        assert overlap_volume(solid, solid) == pytest.approx(volume(solid), rel=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_agrees_with_a_boolean_of_solids(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pool = [*VALID.values(), extrude([SQUARE, YARD], 2, 7), extrude([L_SHAPE], -1, 4)]
    a, b = (pool[i] for i in rng.integers(0, len(pool), 2))
    turn = Rotation.from_rotvec(rng.normal(0, 0.7, 3)).as_matrix()
    a = shifted(a, tuple(RD))
    b = Polyhedron(b.vertices @ turn.T + rng.uniform(-4, 4, 3) + RD, b.faces)
    assert overlap_volume(a, b) == pytest.approx(reference_volume(a, b), abs=1e-5)
