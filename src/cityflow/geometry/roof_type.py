"""The simple roof types that the main planes of a roof tell."""

from __future__ import annotations

import numpy as np

from cityflow.core.building import Polyhedron, RoofPlane, Semantic
from cityflow.geometry.polyhedron import face_areas

LEVEL_DEG = 5.0
OPPOSITE_DEG = 15.0
RIDGE_WITHIN_M = 0.2
MAIN_SHARE = 0.1
"""Faces of a plane below this share of the roof say nothing of its type (dormers, installations)."""
GABLE_SHARE = 0.9
STEP_M = 1.0


def roof_type(solid: Polyhedron, planes: tuple[RoofPlane, ...]) -> str:
    """flat, stepped flat, monopitch, gabled, hipped; complex for other sloped roofs, mixed where some parts are level.

    Planes count by the area of their faces. A gable has two opposite planes with nearly all of the roof that meet on top.
    """
    areas = _areas(solid, planes)
    main = [k for k, area in enumerate(areas) if area > MAIN_SHARE * areas.sum()]
    sloped = [k for k in main if planes[k].slope_deg >= LEVEL_DEG]
    if not main:
        return "unknown"
    if not sloped:
        heights = [planes[k].height for k in main]
        return "flat" if max(heights) - min(heights) < STEP_M else "stepped flat"
    if len(main) == 1:
        return "monopitch"
    pairs = sum(_opposite(planes[i], planes[k]) for i in main for k in main if i < k)
    if len(sloped) == len(main) == 2 and pairs and areas[main].sum() >= GABLE_SHARE * areas.sum():
        return "gabled" if _meet_on_top(solid, [planes[k] for k in main]) else "complex"
    if len(sloped) == len(main) == 4 and pairs == 2:
        return "hipped"
    return "complex" if len(sloped) == len(main) else "mixed"


def _areas(solid: Polyhedron, planes: tuple[RoofPlane, ...]) -> np.ndarray:
    areas = np.zeros(len(planes))
    for face, area in zip(solid.faces, face_areas(solid), strict=True):
        if face.semantic is Semantic.ROOF and 0 <= face.plane < len(planes):
            areas[face.plane] += area
    return areas


def _opposite(a: RoofPlane, b: RoofPlane) -> bool:
    turn = abs((a.aspect_deg - b.aspect_deg + 180) % 360 - 180)
    return turn >= 180 - OPPOSITE_DEG


def _meet_on_top(solid: Polyhedron, planes: list[RoofPlane]) -> bool:
    """A ridge, not a valley nor a step: the planes agree at the highest vertex."""
    x, y, _ = solid.vertices[np.argmax(solid.vertices[:, 2])]
    heights = [float(plane.z(x, y)) for plane in planes]
    return max(heights) - min(heights) <= RIDGE_WITHIN_M
