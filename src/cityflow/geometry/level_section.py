"""What a level plane cuts out of a polyhedron."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.geometry.polyhedron import triangulate

OFF_VERTEX_M = 1.3e-5
"""Vertices are whole tenths of a millimetre, and the plane passes between them."""


def level_section(polyhedron: Polyhedron, z: float) -> MultiPolygon:
    """Section of a closed polyhedron at world height z, in plan; holes are where it is hollow.

    >>> from cityflow.core.building import Face, Semantic
    >>> corners = np.array([[x, y, z] for z in (0.0, 3.0) for x, y in ((0, 0), (4, 0), (4, 2), (0, 2))], float)
    >>> rings = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    >>> level_section(Polyhedron(corners, tuple(Face((r,), Semantic.WALL) for r in rings)), 1.0).area
    8.0
    """
    ends = _cut(polyhedron, round(z, 4) + OFF_VERTEX_M)
    if len(ends) == 0:
        return MultiPolygon()
    cells = [c for c in shapely.get_parts(shapely.polygonize(list(shapely.linestrings(ends)))) if c.area > 0]
    inside = [c for c in cells if _crossings(ends, shapely.point_on_surface(c)) % 2]
    merged = shapely.union_all(inside)
    return MultiPolygon([p for p in shapely.get_parts(merged) if isinstance(p, Polygon)])


def _cut(polyhedron: Polyhedron, z: float) -> FloatArray:
    """(S, 2, 2) segments that the plane cuts out of the triangles; those of neighbours share their ends bit for bit."""
    mesh = triangulate(polyhedron)
    high = mesh.vertices[:, 2] > z
    count = high[mesh.triangles].sum(axis=1)
    t = mesh.triangles[(count == 1) | (count == 2)]
    lone = high[t] == (high[t].sum(axis=1) == 1)[:, None]
    turned = np.take_along_axis(t, (np.argmax(lone, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    ends = np.empty((len(t), 2, 2))
    for k in (1, 2):
        a, b = np.sort(turned[:, [0, k]], axis=1).T
        p, q = mesh.vertices[a], mesh.vertices[b]
        share = (z - p[:, 2]) / (q[:, 2] - p[:, 2])
        ends[:, k - 1] = p[:, :2] + share[:, None] * (q[:, :2] - p[:, :2])
    return np.asarray(ends[np.any(ends[:, 0] != ends[:, 1], axis=1)])


def _crossings(ends: FloatArray, at: shapely.Point) -> int:
    """Segments that a line from a point eastwards crosses."""
    (x_0, y_0), (x_1, y_1) = ends[:, 0].T, ends[:, 1].T
    spans = (y_0 > at.y) != (y_1 > at.y)
    x = x_0[spans] + (at.y - y_0[spans]) / (y_1[spans] - y_0[spans]) * (x_1[spans] - x_0[spans])
    return int(np.count_nonzero(x > at.x))
