"""Buildings of known shape: outlines, and roof faces as planes over polygons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.building import RoofPlane

MAIN, DORMER, CHIMNEY = "main", "dormer", "chimney"
BAY, CANOPY = "bay", "canopy"
BALCONY, PARAPET, POST, PANEL = "balcony", "parapet", "post", "panel"
HULL_KINDS = (MAIN, BAY, CANOPY)
"""Bodies that make the hull of a building; the others stand on it, hang from it or carry it."""


@dataclass(frozen=True, slots=True)
class LocalFace:
    """A plane z = slope_u·u + slope_v·v + height over a polygon, all in the building's own frame (metres).

    The faces of one building may overlap in plan: the highest counts.
    """

    ring: tuple[tuple[float, float], ...]
    slope_u: float
    slope_v: float
    height: float
    kind: str = MAIN


@dataclass(frozen=True, slots=True)
class TruthFace:
    """One visible roof face: plane (world), polygon (world plan), and what it is (main, dormer, chimney)."""

    plane: RoofPlane
    polygon: Polygon
    kind: str


def rectangle(u_0: float, v_0: float, u_1: float, v_1: float) -> tuple[tuple[float, float], ...]:
    return (u_0, v_0), (u_1, v_0), (u_1, v_1), (u_0, v_1)


def hip(length: float, depth: float, eave: float, slope: float) -> list[LocalFace]:
    """Four faces of the same slope; a pyramid where length equals depth. Needs length >= depth."""
    half = depth / 2
    left, right = (half, half), (length - half, half)
    long_ring = ((0.0, 0.0), (length, 0.0), right, left) if length > depth else ((0.0, 0.0), (length, 0.0), left)
    far_ring = ((length, depth), (0.0, depth), left, right) if length > depth else ((length, depth), (0.0, depth), left)
    return [
        LocalFace(long_ring, 0, slope, eave),
        LocalFace(far_ring, 0, -slope, eave + slope * depth),
        LocalFace(((0.0, depth), (0.0, 0.0), left), slope, 0, eave),
        LocalFace(((length, 0.0), (length, depth), right), -slope, 0, eave + slope * length),
    ]


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a building's own frame lies: origin (world metres), heading of u (radians, from east), height of z = 0."""

    x: float
    y: float
    heading: float
    z: float

    def to_world(self, ring: Sequence[tuple[float, float]]) -> FloatArray:
        """(n, 2) world coordinates of own ones."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        u, v = np.asarray(ring, np.float64).T
        return np.column_stack([self.x + c * u - s * v, self.y + s * u + c * v])

    def face(self, local: LocalFace) -> TruthFace:
        c, s = np.cos(self.heading), np.sin(self.heading)
        slope_x = c * local.slope_u - s * local.slope_v
        slope_y = s * local.slope_u + c * local.slope_v
        plane = RoofPlane(float(slope_x), float(slope_y), local.height + self.z, (self.x, self.y))
        return TruthFace(plane, orient(Polygon(self.to_world(local.ring))), local.kind)


def visible_faces(prisms: Sequence[TruthFace]) -> tuple[TruthFace, ...]:
    """The upper envelope: each face without the parts where another one is higher."""
    seen = []
    for i, face in enumerate(prisms):
        polygon = face.polygon
        for j, other in enumerate(prisms):
            if i != j:
                polygon = polygon.difference(_where_higher(other, face, wins_ties=j < i))
        parts = shapely.get_parts(polygon)
        seen += [TruthFace(face.plane, orient(p), face.kind) for p in parts if p.area > 1e-3]
    return tuple(seen)


def _where_higher(upper: TruthFace, lower: TruthFace, wins_ties: bool) -> Polygon:
    """Part of both polygons where `upper` is the higher plane."""
    common = upper.polygon.intersection(lower.polygon)
    if common.area < 1e-6:
        return Polygon()
    x, y = common.centroid.x, common.centroid.y
    at = np.array([x]), np.array([y])
    gap = float((upper.plane.z(*at) - lower.plane.z(*at))[0])
    g = np.array([upper.plane.slope_x - lower.plane.slope_x, upper.plane.slope_y - lower.plane.slope_y])
    norm = float(np.hypot(*g))
    if norm < 1e-9:
        return common if gap > 1e-9 or (wins_ties and gap > -1e-9) else Polygon()
    n, t, far = g / norm, np.array([-g[1], g[0]]) / norm, 1000.0
    foot = np.array([x, y]) - n * gap / norm
    half_plane = Polygon([foot + t * far, foot - t * far, foot - t * far + n * far, foot + t * far + n * far])
    return common.intersection(half_plane)
