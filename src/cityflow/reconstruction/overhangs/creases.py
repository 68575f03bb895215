"""The lines beyond the walls on which two roof faces part: where their planes meet, or the side of a step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.overhangs.rim_edges import RimEdge, meeting, turn_between
from cityflow.reconstruction.overhangs.roof_plan import RoofPlan

TURN_DEG = 1.0
"""Edges that turn less go straight on; set by hand."""
SAME_HEIGHT_M = 0.02
"""Roofs this near to each other over a vertex of the wall meet there; otherwise there is a step, or they meet beside it."""
ASIDE_M = 0.3
"""So far from the vertex at which two roof faces part over the wall their planes may meet: what lies between is noise of the planes; set by hand."""
SAME_SLOPE = 0.01
"""Gradients that differ less have no crease between them; set by hand."""
LEAST_OUTWARD = 0.15
"""A crease that leaves the wall more nearly along it (cosine to the way out) does not run on; set by hand."""
CORNER_TURN_DEG = 15.0
"""Edges that turn by less have no corner in their rim; set by hand."""
TO_TIP_M = 0.2
"""A corner of the rim this near to a crease lies on it: a hip or valley ends in a corner, and reaches are not known better; set by hand."""
FARTHEST = 3.0
"""A crease has left its strip after so many times the greater reach; set by hand."""
OUT_OF_WALL_M, ON_LINE_M = 0.02, 1e-6
"""A crease leaves the walls where it is outside so far on; rounding."""


@dataclass(frozen=True, slots=True)
class Crease:
    """Where two roof faces part.

    Attributes
    ----------
    line : from the wall outwards, farther than any rim
    lower_rim : at a step the lower one of the two edges, moved out; None where planes meet
    """

    line: LineString
    lower_rim: LineString | None

    @property
    def start(self) -> FloatArray:
        return np.asarray(self.line.coords[0])


def crease_of(plan: RoofPlan, one: RimEdge, two: RimEdge, building: shapely.Geometry, far_m: float) -> Crease | None:
    """The crease that begins at, or just beside, the vertex between two edges; None where one roof face goes on.

    Parameters
    ----------
    building : the outline, local
    far_m : length of the line
    """
    if one.face == two.face:
        return None
    way = _common_way(plan, one, two)
    if way is not None:
        met = abs(one.tops[1] - two.tops[0]) <= SAME_HEIGHT_M
        start = two.start if met else _beside(plan, one, two, way, building)
        if start is not None:
            return Crease(LineString([start, start + far_m * way]), None)
    middle = _between(one, two)
    return Crease(
        LineString([two.start, two.start + far_m * middle]), _moved_edge(one if one.tops[1] < two.tops[0] else two)
    )


def corners_on_creases(rims: Sequence[RimEdge], creases: Sequence[Crease]) -> list[tuple[FloatArray, FloatArray]]:
    """Corners of the rim that lie beside a hip, a valley or the side of a step, each with the place on it to which it belongs."""
    by_start = {rim.ends[0]: rim for rim in rims}
    moved = []
    for one in rims:
        two = by_start[one.ends[1]]
        if min(one.reach, two.reach) <= 0 or abs(turn_between(one, two)) < np.radians(CORNER_TURN_DEG):
            continue
        tip = meeting(one, two.moved(two.start), two.along, one.moved(one.end))
        near = [shapely.get_coordinates(shapely.shortest_line(shapely.Point(tip), c.line))[1] for c in creases]
        deep = FARTHEST * max(one.reach, two.reach)
        near = [place for place, c in zip(near, creases, strict=True) if _apart(place, c.start) <= deep]
        apart = [_apart(place, tip) for place in near]
        if apart and min(apart) <= TO_TIP_M:
            moved.append((tip, near[int(np.argmin(apart))]))
    return moved


def up_to_corners(creases: Sequence[Crease], moved: Sequence[tuple[FloatArray, FloatArray]]) -> list[Crease]:
    """The creases, none beyond a corner of the rim that was moved onto it."""
    places = [place for _, place in moved]
    ended = []
    for crease in creases:
        on = [p for p in places if shapely.distance(shapely.Point(p), crease.line) < ON_LINE_M]
        first = min(on, key=lambda p: _apart(p, crease.start), default=None)
        ended.append(crease if first is None else replace(crease, line=LineString([crease.start, first])))
    return ended


def _moved_edge(rim: RimEdge) -> LineString:
    return LineString([rim.moved(rim.start), rim.moved(rim.end)])


def _common_way(plan: RoofPlan, one: RimEdge, two: RimEdge) -> FloatArray | None:
    """Outward direction of the line in which two planes meet; None where it does not lead out."""
    slopes = plan.planes[one.face][:2] - plan.planes[two.face][:2]
    size = float(np.hypot(*slopes))
    if size < SAME_SLOPE:
        return None
    way = np.array([-slopes[1], slopes[0]]) / size
    way = way if way @ _between(one, two) > 0 else -way
    outward = way @ one.outward, way @ two.outward
    straight = turn_between(one, two) < np.radians(TURN_DEG)
    return None if (min(outward) if straight else max(outward)) < LEAST_OUTWARD else way


def _beside(
    plan: RoofPlan, one: RimEdge, two: RimEdge, way: FloatArray, building: shapely.Geometry
) -> FloatArray | None:
    """Where the line in which two planes meet leaves the building, if that is near the vertex between the edges."""
    v = two.start
    a, b, c = plan.planes[one.face] - plan.planes[two.face]
    foot = v - (a * v[0] + b * v[1] + c) / (a * a + b * b) * np.array([a, b])
    if _apart(foot, v) > ASIDE_M:
        return None
    line = LineString([foot - 2 * ASIDE_M * way, foot + 2 * ASIDE_M * way])
    places = shapely.get_coordinates(shapely.intersection(line, shapely.boundary(building)))
    leaving = [
        p
        for p in places
        if _apart(p, v) <= 2 * ASIDE_M
        and not shapely.intersects_xy(building, *(p + OUT_OF_WALL_M * way))
        and shapely.intersects_xy(building, *(p - OUT_OF_WALL_M * way))
    ]
    return min(leaving, key=lambda p: _apart(p, v)) if leaving else None


def _between(one: RimEdge, two: RimEdge) -> FloatArray:
    """From the wall's vertex to where the moved edges cross."""
    v = two.start
    tip = meeting(one, two.moved(two.start), two.along, one.moved(one.end))
    way = tip - v
    length = float(np.hypot(*way))
    if abs(turn_between(one, two)) < np.radians(TURN_DEG) or length < 1e-6 or length > 20 * max(one.reach, two.reach):
        way = one.outward + two.outward
        length = float(np.hypot(*way))
    return np.asarray(way / length)


def _apart(one: FloatArray, other: FloatArray) -> float:
    """Distance of two points of the plan, metres."""
    way: FloatArray = other - one
    return float(np.hypot(way[0], way[1]))
