"""Complexity of a roof: number of planes, steps between them, and planes that noise may have made, as risk factors of a verdict."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.geometry.roof_distances import NEAR

STEP_M = 0.3
"""Lower walls within a roof are no steps: both sides are nearly within reach of the same height; set by hand, as are those below."""
OF_OUTLINE_M = 0.05
"""Walls this near to the outline are its own."""
LEAST_UPWARD = 1e-3
"""Faces less turned upwards are walls; rounding."""
SLIGHT_NOISES = 5.0
"""A plane may be of noise alone where it departs from a larger one by this many times the noise (standard deviation of a bell); of 2, 3, 4, 6 and 8,
4 and 6 told most on the towns of the fit."""


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


def slight_share(solid: Polyhedron, face: IntArray, places: FloatArray, noise: float) -> float:
    """Share of a roof on planes that depart little from a larger plane of the same roof, but by more than 20 cm.

    Errors that neighbouring points share look like a plane of their own, and every point agrees with it.

    Parameters
    ----------
    face : (P,) number of the face at each place, -1 where there is none
    places : (P, 2) all over the outline in plan, evenly spaced
    noise : metres, standard deviation of the points that the roof explains
    """
    planes = np.array([f.plane for f in solid.faces], np.int64)
    here = np.where(face >= 0, planes[face], planes.min(initial=0) - 1)
    kinds, first, count = np.unique(planes[face[face >= 0]], return_index=True, return_counts=True)
    heights = np.array([planes_at(solid, np.full(len(places), k), places) for k in face[face >= 0][first]])
    harmed = 0.0
    for k, plane in enumerate(kinds):
        own = here == plane
        larger = (count > count[k]) | ((count == count[k]) & (kinds < plane))
        apart = np.abs(heights[larger][:, own] - heights[k, own])
        away = np.sqrt(np.mean(apart**2, axis=1))
        of_noise = np.exp(-0.5 * (away / (SLIGHT_NOISES * noise)) ** 2)
        harmed += float(count[k]) * float((of_noise * np.mean(apart > NEAR, axis=1)).max(initial=0.0))
    return harmed / len(places)


def planes_at(solid: Polyhedron, faces: IntArray, xy: FloatArray) -> FloatArray:
    """(N,) heights of the planes of some faces at places that may lie beyond them, metres; NaN for upright faces."""
    z = np.full(len(xy), np.nan)
    for face in np.unique(faces[faces >= 0]):
        corners = solid.ring(solid.faces[face].rings[0])
        middle = corners.mean(axis=0)
        normal = np.linalg.svd(corners - middle, full_matrices=False)[2][-1]
        here = faces == face
        if abs(normal[2]) > LEAST_UPWARD:
            z[here] = middle[2] - ((xy[here] - middle[:2]) @ normal[:2]) / normal[2]
    return z


def ends_in_plan(ring: FloatArray) -> FloatArray:
    """(2, 2) the two places of an upright wall in plan that are furthest apart."""
    xy = ring[:, :2]
    a = xy[int(np.argmax(((xy - xy[0]) ** 2).sum(axis=1)))]
    b = xy[int(np.argmax(((xy - a) ** 2).sum(axis=1)))]
    return np.array([a, b])
