"""The topmost roof over points in plan."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_plane


def roof_heights(solid: Polyhedron, x: FloatArray, y: FloatArray) -> tuple[FloatArray, IntArray]:
    """Height of the topmost roof face over each point, and which face it is.

    Parameters
    ----------
    x, y : (N,) world metres

    Returns
    -------
    z : (N,) metres, NaN where no roof face lies over or under a point
    face : (N,) index into ``solid.faces``, −1 there
    """
    z, top = np.full(len(x), -np.inf), np.full(len(x), -1, np.int64)
    for number, face in enumerate(solid.faces):
        if face.semantic is not Semantic.ROOF:
            continue
        normal, offset = face_plane(solid, number)
        if abs(normal[2]) < 1e-6:
            continue
        near = _in_bounds(solid, face, x, y)
        inside = near[shapely.intersects_xy(_plan(solid, face), x[near], y[near])]
        height = (offset - normal[0] * x[inside] - normal[1] * y[inside]) / normal[2]
        higher = height > z[inside]
        z[inside[higher]], top[inside[higher]] = height[higher], number
    return np.where(top >= 0, z, np.nan), top


def _in_bounds(solid: Polyhedron, face: Face, x: FloatArray, y: FloatArray) -> IntArray:
    ring = solid.ring(face.rings[0])
    (x_min, y_min), (x_max, y_max) = ring[:, :2].min(axis=0), ring[:, :2].max(axis=0)
    return np.flatnonzero((x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max))


def _plan(solid: Polyhedron, face: Face) -> Polygon:
    exterior, *holes = (solid.ring(ring)[:, :2] for ring in face.rings)
    polygon = Polygon(exterior, holes)
    shapely.prepare(polygon)
    return polygon
