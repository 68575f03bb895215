"""Vertices put into the edges of polygons, so that neighbours share them bit for bit."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS


def on_lattice(xy: FloatArray) -> FloatArray:
    """Coordinates as multiples of 0.1 mm (world metres), without negative zeros."""
    return np.round(xy, VERTEX_DECIMALS) + 0.0


def with_vertices(polygon: Polygon, points: FloatArray, tolerance_m: float = 1e-3) -> Polygon:
    """The polygon with those points, (n, 2), as vertices that lie on its edges.

    Points farther than the tolerance from every edge are left out, as are all where they would spoil the polygon.

    >>> with_vertices(Polygon([(0, 0), (4, 0), (4, 4), (0, 4)]), np.array([[2.0, 0.0], [9.0, 9.0]])).wkt
    'POLYGON ((0 0, 2 0, 4 0, 4 4, 0 4, 0 0))'
    """
    rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
    new = [line_with_vertices(ring, np.asarray(points, np.float64).reshape(-1, 2), tolerance_m) for ring in rings]
    if all(len(a) == len(b) for a, b in zip(rings, new, strict=True)):
        return polygon
    result = Polygon(new[0], new[1:])
    return result if result.is_valid else polygon


def line_with_vertices(line: FloatArray, points: FloatArray, tolerance_m: float) -> FloatArray:
    """A polyline, (n, 2), with the points as vertices that lie on its edges."""
    there = {tuple(v) for v in line.tolist()}
    fresh = np.array([p for p in dict.fromkeys(map(tuple, points.tolist())) if p not in there]).reshape(-1, 2)
    if not len(fresh) or len(line) < 2:
        return line
    edges = shapely.linestrings(np.stack([line[:-1], line[1:]], axis=1))
    point, edge = shapely.STRtree(edges).query_nearest(
        shapely.points(fresh), max_distance=tolerance_m, all_matches=False
    )
    along = ((fresh[point] - line[edge]) * (line[edge + 1] - line[edge])).sum(axis=1)
    inside = (along > 0) & (along < ((line[edge + 1] - line[edge]) ** 2).sum(axis=1))
    point, edge, along = point[inside], edge[inside], along[inside]
    order = np.lexsort((along, edge))
    return np.insert(line, edge[order] + 1, fresh[point[order]], axis=0)
