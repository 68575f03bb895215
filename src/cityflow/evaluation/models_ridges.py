"""Ends of level ridges, of a model and of the truth, within the walls: where a ridge meets a gable, or hips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, RoofPlane
from cityflow.evaluation.models_planes import model_surfaces
from cityflow.evaluation.roof_planes import RoofSurface

LEAST_RIDGE_M = 0.5
"""Shorter ridges are not judged; set by hand."""
LEAST_FALL = np.tan(np.radians(3.0))
"""Both sides of a ridge fall away from it at least so."""
LEVEL_TANGENT = np.tan(np.radians(5.0))
"""A ridge rises no more along itself; set by hand."""
TOUCH_M = 0.1
"""Edges of the two sides lie so near the line where their planes meet."""
MEET_M = 0.05
"""Ridges that lie so near to each other are one; set by hand."""
JOIN_M, JOIN_TURN = 1.0, np.sin(np.radians(4.0))
"""Pieces of one line with a smaller gap (chimney, dormer) are one ridge."""

Segment = FloatArray
"""(2, 3) ends, world metres."""


def true_ridge_ends(surfaces: Sequence[RoofSurface], walls: Polygon) -> FloatArray:
    """(n, 3) ends of the ridges between surfaces given in plan."""
    return _ends(_ridges(surfaces, walls))


def model_ridge_ends(solid: Polyhedron, walls: Polygon) -> FloatArray:
    """(n, 3) ends of the ridges of a model, cut at the true walls: how far its roof reaches out is no error of the ridge."""
    return _ends(_ridges(model_surfaces(solid), walls))


def _ridges(surfaces: Sequence[RoofSurface], walls: Polygon) -> list[Segment]:
    inside = [(shapely.intersection(polygon, walls), plane) for polygon, plane in surfaces]
    inside = [s for s in inside if s[0].area > 0]
    found: list[Segment] = []
    for i, a in enumerate(inside):
        for b in inside[:i]:
            if shapely.distance(a[0], b[0]) <= TOUCH_M:
                found += _ridge_between(a, b)
    return _joined(found)


def _ridge_between(a: RoofSurface, b: RoofSurface) -> list[Segment]:
    """Where both planes cut each other, both surfaces touch and fall away on both sides."""
    turn = np.array([a[1].slope_x - b[1].slope_x, a[1].slope_y - b[1].slope_y])
    size = float(np.hypot(*turn))
    if size < LEAST_FALL:
        return []
    middle = np.asarray(shapely.get_coordinates(shapely.centroid(shapely.union_all([a[0], b[0]])))[0])
    gap = float(a[1].z(*middle) - b[1].z(*middle))
    foot, along = middle - turn / size**2 * gap, np.array([-turn[1], turn[0]]) / size
    if abs(along @ _gradient(a[1])) > LEVEL_TANGENT or not _falls_away(a, b, foot, turn / size):
        return []
    common = shapely.intersection(_beside(a[0], foot, along), _beside(b[0], foot, along))
    parts = [p for p in shapely.get_parts(common) if p.length >= LEAST_RIDGE_M]
    return [_lifted(shapely.get_coordinates(p)[[0, -1], 0], foot, along, a[1]) for p in parts]


def _beside(polygon: shapely.Geometry, foot: FloatArray, along: FloatArray) -> shapely.Geometry:
    """Edges of a polygon on a line through `foot`, as pieces of the first axis: metres along the line."""
    pieces = []
    for ring in shapely.get_parts(shapely.boundary(polygon)):
        offset = shapely.get_coordinates(ring) - foot
        off, place = offset[:, 0] * along[1] - offset[:, 1] * along[0], offset @ along
        on = (np.abs(off[:-1]) <= TOUCH_M) & (np.abs(off[1:]) <= TOUCH_M)
        pieces += [
            LineString([(p, 0.0), (q, 0.0)]) for p, q in zip(place[:-1][on], place[1:][on], strict=True) if p != q
        ]
    return shapely.line_merge(shapely.union_all(pieces)) if pieces else LineString()


def _falls_away(a: RoofSurface, b: RoofSurface, foot: FloatArray, across: FloatArray) -> bool:
    """Each surface lies on one side of the line and falls to that side; `across` points where a is higher than b if extended."""
    for (polygon, plane), side in ((a, -1.0), (b, 1.0)):
        offset = side * float((shapely.get_coordinates(shapely.centroid(polygon))[0] - foot) @ across)
        if offset <= 0 or side * float(_gradient(plane) @ across) > -LEAST_FALL:
            return False
    return True


def _gradient(plane: RoofPlane) -> FloatArray:
    return np.array([plane.slope_x, plane.slope_y])


def _lifted(place: FloatArray, foot: FloatArray, along: FloatArray, plane: RoofPlane) -> Segment:
    xy = foot + np.sort(place)[:, None] * along
    return np.column_stack([xy, plane.z(xy[:, 0], xy[:, 1])])


def _joined(segments: list[Segment]) -> list[Segment]:
    """Pieces of the same line made one."""
    rest = sorted(segments, key=lambda s: tuple(np.round(s.min(axis=0), 3)))
    joined: list[Segment] = []
    while rest:
        ridge, changed = rest.pop(0), True
        while changed:
            changed = False
            for k, other in enumerate(rest):
                longer = _as_one(ridge, other)
                if longer is not None:
                    ridge, changed = longer, True
                    del rest[k]
                    break
        joined.append(ridge)
    return joined


def _as_one(a: Segment, b: Segment) -> Segment | None:
    along = a[1] - a[0]
    length = float(np.linalg.norm(along))
    unit = along / length
    off = b - a[0]
    across = np.linalg.norm(off - np.outer(off @ unit, unit), axis=1)
    place = off @ unit
    tolerance = MEET_M + JOIN_TURN * (np.abs(place).max() - length)
    if across.max() > max(tolerance, MEET_M) or place.min() > length + JOIN_M or place.max() < -JOIN_M:
        return None
    points = np.concatenate([a, b])
    order = np.argsort((points - a[0]) @ unit)
    return points[[order[0], order[-1]]]


def _ends(ridges: list[Segment]) -> FloatArray:
    """Ends, each once though two ridges meet there."""
    ends = np.concatenate(ridges) if ridges else np.empty((0, 3))
    kept: list[FloatArray] = []
    for point in ends:
        if all(np.linalg.norm(point - other) > MEET_M for other in kept):
            kept.append(point)
    return np.array(kept).reshape(-1, 3)
