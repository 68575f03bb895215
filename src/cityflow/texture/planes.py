"""Faces that can have a texture, each with a plane and axes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.texture import FacePlane, Shell

TEXTURED = (Semantic.ROOF, Semantic.WALL, Semantic.OUTER_CEILING, Semantic.OUTER_FLOOR)
LEAST_M2 = 1e-4
"""Smaller faces are what rounding leaves; no image has a pixel for them."""
LEVEL = 0.01
"""Sine of the slope up to which a face counts as level: its direction of steepest ascent is chance, so that north is up."""


def face_planes(solid: Polyhedron, beyond: Polyhedron | None) -> tuple[FacePlane, ...]:
    """Faces that can have a texture, first those of the solid, then those of its overhangs, in their order.

    Without one remain faces towards the ground, party walls, and faces without area.
    """
    shells: list[tuple[Shell, Polyhedron | None]] = [("solid", solid), ("beyond", beyond)]
    return tuple(face for name, shell in shells if shell is not None for face in _of_shell(name, shell))


def _of_shell(name: Shell, shell: Polyhedron) -> Iterator[FacePlane]:
    for k, face in enumerate(shell.faces):
        if face.semantic in TEXTURED and face.neighbour is None:
            plane = _plane(name, k, face, shell)
            if plane is not None:
                yield plane


def _plane(name: Shell, number: int, face: Face, shell: Polyhedron) -> FacePlane | None:
    rings = tuple(np.asarray(shell.ring(ring), np.float64) for ring in face.rings)
    origin = rings[0].mean(axis=0)
    normal = _normal(rings[0] - origin)
    if normal is None:
        return None
    up = _up(normal)
    right = np.cross(up, normal)
    flat = [np.column_stack([(ring - origin) @ right, (ring - origin) @ up]) for ring in rings]
    polygon = _polygon(flat)
    if polygon is None:
        return None
    return FacePlane((name, number), face.semantic, rings, origin, right, up, normal, polygon)


def _normal(ring: FloatArray) -> FloatArray | None:
    """Unit normal after Newell; none where the ring encloses nothing."""
    vector = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0) / 2
    length = float(np.linalg.norm(vector))
    return vector / length if length >= LEAST_M2 else None


def _up(normal: FloatArray) -> FloatArray:
    """Unit vector in the plane that climbs most; of level faces the one that points north."""
    level = float(np.hypot(normal[0], normal[1])) <= LEVEL
    wanted = np.array([0.0, 1.0, 0.0]) if level else np.array([0.0, 0.0, 1.0])
    up = wanted - (wanted @ normal) * normal
    return np.asarray(up / np.linalg.norm(up))


def _polygon(flat: list[FloatArray]) -> Polygon | None:
    """The rings as one polygon; where they touch or cross themselves, the greatest part of what they enclose."""
    whole = Polygon(flat[0], [ring for ring in flat[1:] if len(ring) >= 3])
    if not whole.is_valid:
        parts = [p for p in shapely.get_parts(shapely.make_valid(whole)) if isinstance(p, Polygon)]
        whole = max(parts, key=lambda p: float(p.area), default=Polygon())
    return whole if whole.area >= LEAST_M2 else None
