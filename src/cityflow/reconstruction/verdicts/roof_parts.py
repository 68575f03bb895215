"""Complexity of a roof: number of planes, and steps between them, as risk factors of a verdict."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, Semantic

STEP_M = 0.3
"""Lower walls within a roof are no steps: both sides are nearly within reach of the same height; set by hand, as are those below."""
OF_OUTLINE_M = 0.05
"""Walls this near to the outline are its own."""


def plane_count(solid: Polyhedron) -> int:
    """Number of different planes of the roof."""
    return len({face.plane for face in solid.of_semantic(Semantic.ROOF)})


def step_length(solid: Polyhedron, outline: Polygon) -> float:
    """Length in plan of the walls within the outline, metres."""
    rings = [solid.ring(f.rings[0]) for f in solid.of_semantic(Semantic.WALL)]
    rings = [r for r in rings if np.ptp(r[:, 2]) > STEP_M]
    if not rings:
        return 0.0
    walls = np.array([ends_in_plan(r) for r in rings])
    inside = shapely.distance(shapely.points(walls.mean(axis=1)), outline.boundary) > OF_OUTLINE_M
    return float(np.linalg.norm(walls[inside, 1] - walls[inside, 0], axis=1).sum())


def ends_in_plan(ring: FloatArray) -> FloatArray:
    """(2, 2) the two places of an upright wall in plan that are furthest apart."""
    xy = ring[:, :2]
    a = xy[int(np.argmax(((xy - xy[0]) ** 2).sum(axis=1)))]
    b = xy[int(np.argmax(((xy - a) ** 2).sum(axis=1)))]
    return np.array([a, b])
