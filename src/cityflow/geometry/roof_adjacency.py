"""Roof faces as surfaces in plan, and how neighbouring ones meet: in a ridge, a hip, a valley, a bend or a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, RoofPlane, Semantic
from cityflow.geometry.polyhedron import face_plane

STEEPEST = 0.05
"""Faces whose normal rises less are no roof that is seen from above; set by hand."""
LEVEL_DEG = 3.0
"""Less steep is level; set by hand."""
TOUCH_M, LEAST_BORDER_M = 0.05, 0.3
"""Surfaces within the first of each other over more than the second have a border; set by hand."""
STEP_M, FARTHEST_M = 0.3, 0.5
"""Where heights along a border differ by more (in the middle, anywhere), a wall stands between two surfaces; set by hand."""
ALIKE_DEG, BENT_DEG = 2.5, 6.0
"""Surfaces that turn less are one, and less than the second meet in a bend; set by hand."""
LEVEL_SHARE = 0.35
"""A border is level where it rises less than this share of the slopes beside it; set by hand."""


class Meeting(Enum):
    """How two surfaces meet; a bend is too slight to be anything else, a break is level, and the lower side is the steeper one."""

    SAME = "same"
    BEND = "bend"
    RIDGE = "ridge"
    HIP = "hip"
    BREAK = "break"
    VALLEY = "valley"
    STEP = "step"


@dataclass(frozen=True, slots=True)
class RoofSurface:
    """A polygon in plan (world) with the plane of the roof over it, and the number of the plane it was made from (-1: none)."""

    polygon: Polygon
    plane: RoofPlane
    number: int = -1

    @property
    def gradient(self) -> FloatArray:
        return np.array([self.plane.slope_x, self.plane.slope_y])

    @property
    def is_level(self) -> bool:
        return self.plane.slope_deg < LEVEL_DEG

    def heights(self) -> FloatArray:
        """At the corners, metres."""
        x, y = shapely.get_coordinates(self.polygon).T
        return self.plane.z(x, y)


@dataclass(frozen=True, slots=True)
class Border:
    """Where surfaces `a` and `b` (their places in a sequence) touch in plan: length in metres, mean height, ends (2, 2)."""

    a: int
    b: int
    meeting: Meeting
    length_m: float
    z: float
    ends: FloatArray


def roof_surfaces(solid: Polyhedron) -> list[RoofSurface]:
    """Roof faces of a polyhedron with the planes through their corners."""
    surfaces = []
    for number, face in enumerate(solid.faces):
        if face.semantic is not Semantic.ROOF:
            continue
        normal, offset = face_plane(solid, number)
        if not abs(normal[2]) > STEEPEST:
            continue
        rings = [solid.ring(r)[:, :2] for r in face.rings]
        polygon = shapely.make_valid(Polygon(rings[0], rings[1:]))
        x, y = rings[0][0]
        height = (offset - normal[0] * x - normal[1] * y) / normal[2]
        plane = RoofPlane(
            float(-normal[0] / normal[2]), float(-normal[1] / normal[2]), float(height), (float(x), float(y))
        )
        surfaces += [
            RoofSurface(p, plane, face.plane) for p in shapely.get_parts(polygon) if isinstance(p, Polygon) and p.area
        ]
    return surfaces


def borders(surfaces: Sequence[RoofSurface]) -> list[Border]:
    """All borders of some length, in the order of the surfaces."""
    if not surfaces:
        return []
    polygons = [s.polygon for s in surfaces]
    tree = shapely.STRtree(polygons)
    first, second = tree.query(polygons, predicate="dwithin", distance=TOUCH_M)
    order = np.lexsort((second, first))
    first, second = (v[order][first[order] < second[order]] for v in (first, second))
    common = shapely.intersection(shapely.boundary(polygons)[first], shapely.buffer(polygons, TOUCH_M)[second])
    found = (_border(i, k, c, surfaces) for i, k, c in zip(first.tolist(), second.tolist(), common, strict=True))
    return [b for b in found if b is not None]


def _border(i: int, k: int, common: shapely.Geometry, surfaces: Sequence[RoofSurface]) -> Border | None:
    """Of two surfaces; `common` is what of the first one's outline is near the second one."""
    a, b = surfaces[i], surfaces[k]
    common = shapely.line_merge(common) if common.geom_type == "MultiLineString" else common
    lines = [p for p in shapely.get_parts(common) if p.geom_type == "LineString" and p.length > LEAST_BORDER_M]
    if not lines:
        return None
    longest = max(lines, key=lambda p: p.length)
    xy = shapely.get_coordinates(shapely.line_interpolate_point(longest, [0.1, 0.5, 0.9], normalized=True))
    heights = a.plane.z(*xy.T), b.plane.z(*xy.T)
    ends = xy[[0, 2]]
    inward = _inward(a.polygon, ends)
    meeting = _meeting(a, b, inward, np.abs(heights[0] - heights[1]))
    return Border(i, k, meeting, float(sum(p.length for p in lines)), float(np.mean(heights)), ends)


def _inward(polygon: Polygon, ends: FloatArray) -> FloatArray:
    """Unit vector across the line between `ends`, into the polygon."""
    along = ends[1] - ends[0]
    across = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    middle = ends.mean(axis=0)
    probes = shapely.points([middle + 2 * TOUCH_M * across, middle - 2 * TOUCH_M * across])
    near, far = shapely.distance(polygon, probes)
    return across if near <= far else -across


def _meeting(a: RoofSurface, b: RoofSurface, inward: FloatArray, gap: FloatArray) -> Meeting:
    """Of two surfaces along a border; `inward` points into a across it, and `gap` (metres) is how far they miss each other at places on it."""
    if np.median(gap) > STEP_M or gap.max() > FARTHEST_M:
        return Meeting.STEP
    kink = _kink_deg(a.plane, b.plane)
    if kink < ALIKE_DEG or (a.number == b.number >= 0):
        return Meeting.SAME
    rise_a, rise_b = float(a.gradient @ inward), float(b.gradient @ inward)
    if rise_b < rise_a:
        return Meeting.VALLEY if kink >= BENT_DEG else Meeting.BEND
    along = abs(float(a.gradient @ [-inward[1], inward[0]]))
    steepness = (float(np.hypot(*a.gradient)) + float(np.hypot(*b.gradient))) / 2
    if along > LEVEL_SHARE * steepness:
        return Meeting.HIP
    return Meeting.RIDGE if rise_a < 0 < rise_b and not (a.is_level or b.is_level) else Meeting.BREAK


def _kink_deg(a: RoofPlane, b: RoofPlane) -> float:
    normals = [np.array([p.slope_x, p.slope_y, -1.0]) for p in (a, b)]
    cosine = normals[0] @ normals[1] / np.linalg.norm(normals[0]) / np.linalg.norm(normals[1])
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
