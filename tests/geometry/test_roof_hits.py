"""Heights over a roof, held against every triangle with every point."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.geometry.polyhedron import triangulate
from cityflow.geometry.roof_distances import roof_hits
from geometry_shapes import gable, hip_roof, stepped, tower_on_roof


def topmost(solid: Polyhedron, xyz: FloatArray) -> FloatArray:
    """(N,) height of the highest roof triangle over each point, NaN where there is none."""
    mesh = triangulate(solid)
    is_roof = np.array([f.semantic is Semantic.ROOF for f in solid.faces])[mesh.faces]
    top = np.full(len(xyz), -np.inf)
    for a, b, c in solid.vertices[mesh.triangles[is_roof]]:
        u, v = b - a, c - a
        area = u[0] * v[1] - u[1] * v[0]
        if abs(area) < 1e-12:
            continue
        x, y = xyz[:, 0] - a[0], xyz[:, 1] - a[1]
        s, t = (x * v[1] - y * v[0]) / area, (u[0] * y - u[1] * x) / area
        on = (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9)
        top = np.where(on, np.maximum(top, a[2] + s * u[2] + t * v[2]), top)
    return np.where(np.isfinite(top), xyz[:, 2] - top, np.nan)


@pytest.mark.parametrize(
    "solid", [gable(), hip_roof(), stepped(), tower_on_roof()], ids=["gable", "hip", "stepped", "tower"]
)
@pytest.mark.parametrize("count", [1, 7, 5000])
def test_no_point_is_left_out(solid: Polyhedron, count: int) -> None:
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    rng = np.random.default_rng(count)
    xyz = rng.uniform(low - 2, high + 2, (count, 3))
    on_edges = np.concatenate([xyz, solid.vertices, (solid.vertices + np.roll(solid.vertices, 1, axis=0)) / 2])
    face, found = roof_hits(solid, on_edges)
    assert np.array_equal(found, topmost(solid, on_edges), equal_nan=True)
    assert np.array_equal(face >= 0, np.isfinite(found))
    assert all(solid.faces[k].semantic is Semantic.ROOF for k in np.unique(face[face >= 0]))


def test_places_that_are_nowhere_have_no_roof() -> None:
    face, found = roof_hits(gable(), np.array([[np.nan, 1.0, 2.0], [1.0, np.inf, 0.0], [1e9, -1e9, 0.0]]))
    assert face.tolist() == [-1, -1, -1]
    assert np.isnan(found).all()
    assert len(roof_hits(gable(), np.empty((0, 3)))[0]) == 0
