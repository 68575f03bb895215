"""The type of a roof, from how its surfaces meet.

Dormers, chimneys and lift houses are counted to the surface that they stand on. What hangs together by ridges, hips and bends is a body; valleys and
steps part bodies. Each body has a type by its ridge and by what closes the ridge's ends, and the roof has the type of those bodies
that make up most of it: so a small annexe, or a wing across, does not change the name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron, RoofPlane
from cityflow.core.roof_type_names import RoofType
from cityflow.geometry.roof_adjacency import TOUCH_M, Border, Meeting, RoofSurface, borders, roof_surfaces

SMALL_M2, SMALL_SHARE = 1.0, 0.01
"""Smaller surfaces say nothing; set by hand, as is the next."""
STANDS_ON, STANDING_SHARE, LIFTED_M = 0.8, 0.35, 0.15
"""What lies to so much in the hull of a larger surface, and above it, stands on it."""
MAIN_SHARE, LEVEL_SHARE, RIVAL_SHARE = 0.55, 0.7, 0.35
"""Of the area: what names the roof, what a flat one has level, and what another type may have beside it; set by hand, as are those below."""
STEP_M = 1.0
"""Level parts nearer in height are one."""
PYRAMID_RIDGE = 0.12
"""A ridge shorter than this share of the body's width is a point."""
ROUND, CONE_SURFACES, DOME_SURFACES, DOME_DEG = 0.93, 7, 8, 15.0
"""Roundness (isoperimetric quotient) of a disc that is drawn with corners; surfaces of a cone, and of a dome, and how far their slopes differ."""
HALF_HIP = 0.25
"""An end that begins so far up between eave and ridge is a half-hip."""
END_SHARE = 0.1
"""Ends of less area than this share of the squared width are no hips: a hip of 45 degrees in plan has a quarter."""
MANSARD_PERIMETER, STEEP_DEG = 0.3, 30.0
"""Of the outline's length that steep lower surfaces run along, and how steep they are."""
TEETH = 3
"""Fewer sheds make no sawtooth."""
SAME_WAY_DEG, AROUND_DEG = 30.0, 250.0
"""Aspects nearer to each other are one; aspects all around span more."""

JOINING = (Meeting.SAME, Meeting.BEND, Meeting.RIDGE, Meeting.HIP, Meeting.BREAK)


@dataclass(frozen=True, slots=True)
class _Body:
    """Surfaces that hang together, the borders among them, and what it is."""

    surfaces: list[RoofSurface]
    inner: list[Border]
    area: float
    kind: RoofType


def roof_type(solid: Polyhedron, planes: tuple[RoofPlane, ...] = ()) -> RoofType:
    """Type by the names of `core.roof_type_names`; `planes` are those that the faces refer to, where there are any."""
    surfaces = roof_surfaces(solid)
    if not planes:
        surfaces = [RoofSurface(s.polygon, s.plane) for s in surfaces]
    return type_of_surfaces(surfaces)


def type_of_surfaces(surfaces: Sequence[RoofSurface]) -> RoofType:
    """As `roof_type`, of surfaces that do not overlap in plan."""
    total = sum(s.polygon.area for s in surfaces)
    large = [s for s in surfaces if s.polygon.area >= min(SMALL_M2, 0.2 * total)]
    whole, areas = _without_what_stands_on(_merged(large))
    if not whole:
        return RoofType.UNKNOWN
    met = borders(whole)
    bodies = _bodies(whole, met, areas)
    return _special(bodies, whole, met, areas) or _dominant(bodies)


def _merged(surfaces: list[RoofSurface]) -> list[RoofSurface]:
    """Faces of one plane that touch made one surface."""
    same = [(b.a, b.b) for b in borders(surfaces) if b.meeting is Meeting.SAME]
    merged = []
    for members in _groups(len(surfaces), same):
        parts = [surfaces[k] for k in members]
        best = max(parts, key=lambda s: s.polygon.area)
        polygon = shapely.union_all([p.polygon for p in parts], grid_size=1e-3)
        merged.append(RoofSurface(polygon, best.plane, best.number))
    return merged


def _groups(count: int, links: Sequence[tuple[int, int]]) -> list[IntArray]:
    rows, cols = np.array(links, np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(rows)), (rows, cols)), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return [np.flatnonzero(label == g) for g in range(number)]


def _without_what_stands_on(surfaces: list[RoofSurface]) -> tuple[list[RoofSurface], FloatArray]:
    """Surfaces that carry the roof, and their areas in plan, with what stands on them."""
    order = sorted(surfaces, key=lambda s: -s.polygon.area)
    kept: list[RoofSurface] = []
    areas: list[float] = []
    hulls: list[shapely.Geometry] = []
    for surface in order:
        carrier = next((k for k, s in enumerate(kept) if _stands_on(surface, s, hulls[k])), -1)
        if carrier >= 0:
            areas[carrier] += surface.polygon.area
            continue
        kept.append(surface)
        areas.append(surface.polygon.area)
        hulls.append(shapely.convex_hull(surface.polygon))
    least = SMALL_SHARE * sum(areas)
    chosen = [k for k, area in enumerate(areas) if area >= least]
    return [kept[k] for k in chosen], np.array([areas[k] for k in chosen])


def _stands_on(surface: RoofSurface, carrier: RoofSurface, hull: shapely.Geometry) -> bool:
    area = surface.polygon.area
    if area > STANDING_SHARE * carrier.polygon.area:
        return False
    middle = shapely.centroid(surface.polygon)
    if float(surface.plane.z(middle.x, middle.y) - carrier.plane.z(middle.x, middle.y)) < LIFTED_M:
        return False
    return bool(shapely.intersection(hull, surface.polygon).area >= STANDS_ON * area)


def _bodies(surfaces: list[RoofSurface], met: Sequence[Border], areas: FloatArray) -> list[_Body]:
    links = [(b.a, b.b) for b in met if b.meeting in JOINING]
    bodies = []
    for members in _groups(len(surfaces), links):
        inside = set(members.tolist())
        inner = [b for b in met if b.a in inside and b.b in inside]
        parts = [surfaces[k] for k in members]
        bodies.append(_Body(parts, inner, float(areas[members].sum()), _body_type(members, surfaces, inner)))
    return sorted(bodies, key=lambda b: -b.area)


def _body_type(members: IntArray, surfaces: list[RoofSurface], inner: list[Border]) -> RoofType:
    parts = [surfaces[k] for k in members]
    sloped = [s for s in parts if not s.is_level]
    if not sloped:
        return RoofType.FLAT
    outline = _closed(parts)
    ridges = [b for b in inner if b.meeting is Meeting.RIDGE]
    aspects = np.sort([s.plane.aspect_deg for s in sloped])
    spread = 360.0 - float(np.max(np.diff(np.append(aspects, aspects[0] + 360.0))))
    around = len(sloped) >= 3 and spread * len(sloped) / (len(sloped) - 1) >= AROUND_DEG
    pointed = around and sum(b.length_m for b in ridges) <= PYRAMID_RIDGE * float(np.sqrt(outline.area))
    if pointed and _roundness(outline) >= ROUND:
        return _round(sloped)
    if _is_mansard(surfaces, inner, outline):
        return RoofType.MANSARD
    if sum(s.polygon.area for s in parts if s.is_level) >= LEVEL_SHARE * sum(s.polygon.area for s in parts):
        return RoofType.FLAT
    if pointed:
        return RoofType.PYRAMID if len(sloped) < CONE_SURFACES else RoofType.CONE
    if ridges:
        return _ridged(surfaces, inner, ridges, outline)
    return RoofType.SHED if spread <= SAME_WAY_DEG else RoofType.COMPLEX


def _closed(parts: Sequence[RoofSurface]) -> shapely.Geometry:
    """Union in plan, without the slits between polygons that do not quite touch."""
    wide = shapely.union_all(shapely.buffer([s.polygon for s in parts], 2 * TOUCH_M, join_style="mitre"))
    return shapely.buffer(wide, -2 * TOUCH_M, join_style="mitre")


def _roundness(outline: shapely.Geometry) -> float:
    """1 for a circle, 0.95 for an octagon, 0.79 for a square."""
    return float(4 * np.pi * outline.area / max(outline.length, 1e-9) ** 2)


def _round(sloped: list[RoofSurface]) -> RoofType:
    """All slopes rise to one place over a round floor."""
    slopes = [s.plane.slope_deg for s in sloped]
    several = len(sloped) >= DOME_SURFACES and max(slopes) - min(slopes) > DOME_DEG
    return RoofType.DOME if several else RoofType.CONE


def _ridged(
    surfaces: list[RoofSurface], inner: list[Border], ridges: list[Border], outline: shapely.Geometry
) -> RoofType:
    """A body with a ridge: what else joins the slopes beside it closes an end."""
    beside = {k for b in ridges for k in (b.a, b.b)}
    top = max(b.z for b in ridges)
    eave = min(float(surfaces[k].heights().min()) for k in beside)
    width = _width(outline)
    ends = {k for b in inner if b.meeting is Meeting.HIP for k in (b.a, b.b)} - beside
    halves, wholes = 0, 0
    for k in sorted(ends):
        if (float(surfaces[k].heights().min()) - eave) / max(top - eave, 1e-9) > HALF_HIP:
            halves += 1
        elif surfaces[k].polygon.area >= END_SHARE * width**2:
            wholes += 1
    if halves + wholes == 0:
        return RoofType.GABLE
    return RoofType.HALF_HIP if halves >= wholes else RoofType.HIP


def _width(outline: shapely.Geometry) -> float:
    """Shorter side of the smallest rectangle around it, metres."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    return float(np.hypot(*np.diff(corners[:3], axis=0).T).min()) if len(corners) > 3 else 0.0


def _is_mansard(surfaces: list[RoofSurface], inner: list[Border], outline: shapely.Geometry) -> bool:
    """Slopes that go on less steep above a level line, on several sides and along much of the outline."""
    length, aspects = 0.0, []
    for border in inner:
        steep = max((surfaces[k] for k in (border.a, border.b)), key=lambda s: s.plane.slope_deg)
        if border.meeting is Meeting.BREAK and steep.plane.slope_deg >= STEEP_DEG:
            length += border.length_m
            aspects.append(steep.plane.aspect_deg)
    several = any(_turn_deg(a, aspects[0]) > 90.0 - SAME_WAY_DEG for a in aspects)
    return several and length >= MANSARD_PERIMETER * outline.length


def _special(
    bodies: list[_Body], surfaces: list[RoofSurface], met: Sequence[Border], areas: FloatArray
) -> RoofType | None:
    """Roofs that are what they are by how their bodies stand to each other: butterfly, saw-tooth."""
    total = float(areas.sum())
    for b in met:
        pair = surfaces[b.a], surfaces[b.b]
        if b.meeting is Meeting.VALLEY and not (pair[0].is_level or pair[1].is_level):
            turn = _turn_deg(pair[0].plane.aspect_deg, pair[1].plane.aspect_deg)
            if turn >= 180.0 - SAME_WAY_DEG and areas[[b.a, b.b]].sum() >= LEVEL_SHARE * total:
                return RoofType.BUTTERFLY
    sheds = [b for b in bodies if b.kind is RoofType.SHED]
    if len(sheds) >= TEETH and sum(b.area for b in sheds) >= LEVEL_SHARE * total:
        aspects = [b.surfaces[0].plane.aspect_deg for b in sheds]
        if max(_turn_deg(a, aspects[0]) for a in aspects) <= SAME_WAY_DEG:
            return RoofType.SAWTOOTH
    return None


def _turn_deg(a: float, b: float) -> float:
    return abs((a - b + 180.0) % 360.0 - 180.0)


def _dominant(bodies: list[_Body]) -> RoofType:
    """The type that most of the roof has."""
    total = sum(b.area for b in bodies)
    shares: dict[RoofType, float] = {}
    for body in bodies:
        shares[body.kind] = shares.get(body.kind, 0.0) + body.area / total
    best = max(shares, key=lambda kind: shares[kind])
    if best is RoofType.FLAT:
        return _level(bodies, total) if shares[best] >= LEVEL_SHARE else RoofType.COMPLEX
    rivals = sum(share for kind, share in shares.items() if kind not in (best, RoofType.FLAT))
    if shares[best] < MAIN_SHARE or rivals > RIVAL_SHARE:
        return RoofType.COMPLEX
    if best is RoofType.SHED and bodies[0].area < MAIN_SHARE * total:
        return RoofType.COMPLEX
    return best


def _level(bodies: list[_Body], total: float) -> RoofType:
    """One level, or several."""
    heights = np.array([float(np.mean(b.surfaces[0].heights())) for b in bodies if b.kind is RoofType.FLAT])
    areas = np.array([b.area for b in bodies if b.kind is RoofType.FLAT])
    together = max(float(areas[np.abs(heights - h) < STEP_M].sum()) for h in heights)
    return RoofType.FLAT if together >= LEVEL_SHARE * total else RoofType.STEPPED_FLAT
