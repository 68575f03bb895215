"""The roof plane beside every place of an outline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic

BESIDE_M = 0.02
"""The roof beside a wall is the one this far inside."""


def face_planes(solid: Polyhedron, origin: FloatArray) -> tuple[list[Polygon], FloatArray]:
    """Roof faces in plan and (F, 3) a, b, c of z = a·x + b·y + c; both local to `origin` (3,), metres."""
    polygons, planes = [], []
    for face in solid.of_semantic(Semantic.ROOF):
        rings = [solid.ring(r) - origin for r in face.rings]
        shell, *holes = (r[:, :2] for r in rings)
        points = np.concatenate(rings)
        middle = points.mean(axis=0)
        near = points - middle
        a, b = np.linalg.lstsq(near[:, :2], near[:, 2], rcond=None)[0]
        polygons.append(Polygon(shell, holes))
        planes.append((a, b, middle[2] - a * middle[0] - b * middle[1]))
    return polygons, np.asarray(planes, np.float64).reshape(-1, 3)


def faces_beside(polygons: Sequence[Polygon], xy: FloatArray) -> IntArray:
    """(N,) the face that each place (N, 2) lies in, or the nearest one; -1 where there is none."""
    if not polygons:
        return np.full(len(xy), -1)
    found, lost = np.full(len(xy), -1), np.arange(len(xy))
    for number, polygon in enumerate(polygons):
        inside = shapely.contains_xy(polygon, xy[lost, 0], xy[lost, 1])
        found[lost[inside]] = number
        lost = lost[~inside]
    if len(lost):
        found[lost] = shapely.STRtree(list(polygons)).nearest(shapely.points(xy[lost]))
    return found
