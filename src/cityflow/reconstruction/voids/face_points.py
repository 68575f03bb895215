"""How many points show each face of a void or of a body; 0 where a face follows from others alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Polyhedron
from cityflow.core.points import PointCloud
from cityflow.geometry.polyhedron import face_normals
from cityflow.reconstruction.voids.seen_walls import FACING, SeenWalls

NEAR_M, RIM_M = 0.25, 0.1
"""Points so near to the plane of a face, and so far beyond its rim, show it; set by hand."""
LEVEL = 0.5
"""A face whose normal rises more than this is level."""


def with_face_points(solid: Polyhedron, seen: SeenWalls, roofs: PointCloud) -> Polyhedron:
    """The solid with the points counted of all faces that have a number of them, by points that face as they do.

    Parameters
    ----------
    roofs : points around the unit, world frame
    """
    origin = np.append(seen.origin, 0.0)
    upwards, walls = np.concatenate([seen.level + origin, roofs.xyz]), seen.xyz + origin
    faces: list[Face] = []
    for face, normal in zip(solid.faces, face_normals(solid), strict=True):
        if face.points is not None:
            if normal[2] < -LEVEL:
                points = np.empty((0, 3))  # no view from above shows an underside
            elif normal[2] > LEVEL:
                points = upwards
            else:
                points = walls[seen.normal @ normal[:2] >= FACING]
            face = replace(face, points=_count(points, [solid.ring(r) for r in face.rings], normal))
        faces.append(face)
    return Polyhedron(solid.vertices, tuple(faces))


def _count(points: FloatArray, rings: list[FloatArray], normal: FloatArray) -> int:
    near = points[np.abs((points - rings[0][0]) @ normal) <= NEAR_M] - rings[0][0]
    if not len(near):
        return 0
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    axes = np.column_stack([across, np.cross(normal, across)])
    shell, *holes = ((ring - rings[0][0]) @ axes for ring in rings)
    uv = near @ axes
    return int(shapely.contains_xy(Polygon(shell, holes).buffer(RIM_M), uv[:, 0], uv[:, 1]).sum())
