"""Roof planes of a model against the true ones: completeness, correctness and accuracy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import RoofPlane

SMALLEST_M2 = 2.0
"""Smaller surfaces, chimneys for instance, do not count."""
SHARE = 0.5
"""A true face is found where more of it has a face of the model: the majority."""
LARGEST_ANGLE_DEG, LARGEST_DISTANCE_M = 10.0, 0.5
"""Faces that turn more, or lie farther apart, are others; set by hand."""

RoofSurface = tuple[Polygon, RoofPlane]
"""Where a surface is seen from above (world), and its plane."""


@dataclass(frozen=True, slots=True)
class PlaneMatches:
    """Numbers of surfaces and matches.

    Attributes
    ----------
    true, found : surfaces of at least `SMALLEST_M2`;  recovered : of the true ones;  correct : of the found ones
    angle_deg : (recovered,) between the normals;  distance_m : (recovered,) of the found above the true plane, metres, where both are
    """

    true: int
    found: int
    recovered: int
    correct: int
    angle_deg: FloatArray
    distance_m: FloatArray


def match_planes(true: Sequence[RoofSurface], found: Sequence[RoofSurface]) -> PlaneMatches:
    """A surface counts where another of about the same plane (10°, 0.5 m) covers more than half of it."""
    large = [s for s in true if s[0].area >= SMALLEST_M2]
    given = [s for s in found if s[0].area >= SMALLEST_M2]
    pairs = [best for best in (_covering(s, given) for s in large) if best is not None]
    correct = sum(_covering(s, large) is not None for s in given)
    angle, distance = (np.array([p[k] for p in pairs], np.float64) for k in (0, 1))
    return PlaneMatches(len(large), len(given), len(pairs), correct, angle, -distance)


def _covering(surface: RoofSurface, others: Sequence[RoofSurface]) -> tuple[float, float] | None:
    """Angle (degrees) and height (metres) of `surface` over those that lie on about its plane and cover it, None where too little is covered."""
    polygon, plane = surface
    near: list[tuple[float, float, float]] = []
    for other, its_plane in others:
        common = shapely.intersection(polygon, other)
        if common.area <= 0:
            continue
        place = common.centroid
        x, y = np.array([place.x]), np.array([place.y])
        angle, height = angle_between(plane, its_plane), float((plane.z(x, y) - its_plane.z(x, y))[0])
        if angle <= LARGEST_ANGLE_DEG and abs(height) <= LARGEST_DISTANCE_M:
            near.append((common.area, angle, height))
    if sum(area for area, _, _ in near) <= SHARE * polygon.area:
        return None
    _, angle, height = max(near)
    return angle, height


def angle_between(a: RoofPlane, b: RoofPlane) -> float:
    """Angle between the normals of two planes, degrees.

    >>> angle_between(RoofPlane(1.0, 0.0, 0.0, (0.0, 0.0)), RoofPlane(0.0, 0.0, 5.0, (0.0, 0.0)))
    45.0
    """
    normals = [np.array([p.slope_x, p.slope_y, -1.0]) for p in (a, b)]
    cosine = normals[0] @ normals[1] / np.linalg.norm(normals[0]) / np.linalg.norm(normals[1])
    return round(float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))), 9)
