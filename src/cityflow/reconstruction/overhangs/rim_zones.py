"""The strip of roof beyond the walls in plan, cut where the planes of neighbouring roof faces meet in it.

Every edge of the outline is moved out by its reach; edges meet where their moved lines cross. A ridge, hip or valley that ends
at the wall runs on into the strip along the line in which its two planes intersect, so that both go on undisturbed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.overhangs.roof_plan import RoofPlan

LONGEST_MITRE = 3.0
"""A corner reaches out by no more than so many times the greater reach of its edges; sharper ones are cut off."""
SAME_HEIGHT_M = 0.02
"""Roofs this near to each other over a corner of the wall meet there; otherwise there is a step."""
TURN_DEG = 1.0
SAME_SLOPE = 0.01
LEAST_OUTWARD = 0.15
"""A crease that leaves the wall more nearly along it (cosine to the way out) does not run on."""
PARTY_TURN_DEG = (40.0, 140.0)
"""Where a wall shared with a neighbour leaves the façade under such an angle, the roof ends on its extension."""
SLIVER_M2 = 1e-4
LEAST_WIDTH_M = 2e-3
BEYOND_M = 1e-5
TO_CORNER_M = 0.03


@dataclass(frozen=True, slots=True)
class RimEdge:
    """A piece of the outline over which one roof face ends.

    Attributes
    ----------
    ends : plan vertices, the building on the left
    start, along, outward : (2,) local position and unit vectors
    length, reach : metres
    face : roof face over it
    party : a neighbour touches it
    tops : heights of the roof over its ends
    """

    ends: tuple[int, int]
    start: FloatArray
    along: FloatArray
    length: float
    reach: float
    face: int
    party: bool
    tops: tuple[float, float]

    @property
    def outward(self) -> FloatArray:
        return np.array([self.along[1], -self.along[0]])

    @property
    def end(self) -> FloatArray:
        return self.start + self.length * self.along

    def moved(self, place: FloatArray) -> FloatArray:
        return np.asarray(place + self.reach * self.outward)


def rim_edges(
    plan: RoofPlan, reach: Sequence[float], party: Sequence[bool], edges: Sequence[tuple[int, int]]
) -> list[RimEdge]:
    """Pieces of the outline with the reach of each, in the order of `edges`."""
    border, local = plan.border(), plan.local()
    found = []
    for (u, v), r, shared in zip(edges, reach, party, strict=True):
        way = local[v] - local[u]
        length = float(np.hypot(*way))
        cell = plan.cells[border[u, v]]
        found.append(
            RimEdge((u, v), local[u], way / length, length, r, cell.face, shared, (cell.tops[u], cell.tops[v]))
        )
    return found


def rim_zones(plan: RoofPlan, rims: Sequence[RimEdge], deep_m: float) -> list[Polygon]:
    """Polygons, local to the plan's origin, that together are the roof beyond the walls; each belongs to one roof face.

    Parameters
    ----------
    deep_m : so deep beyond a shared wall is the neighbour
    """
    by_start = {rim.ends[0]: rim for rim in rims}
    strips: list[shapely.Geometry] = []
    creases: list[LineString] = []
    for rim in rims:
        following = by_start[rim.ends[1]]
        before = next(r for r in rims if r.ends[1] == rim.ends[0])
        if rim.reach > 0:
            strips.append(_strip(rim, before, following))
        if rim.reach > 0 and following.reach > 0:
            corner = _corner(rim, following)
            if corner is not None:
                strips.append(corner)
            crease = _crease(plan, rim, following)
            if crease is not None:
                creases.append(crease)
    if not strips:
        return []
    zone = shapely.difference(shapely.union_all(strips), _taken(plan, rims, deep_m))
    parts = [p for p in shapely.get_parts(zone) if p.geom_type == "Polygon" and p.area > SLIVER_M2]
    return [piece for part in parts for piece in _cut(part, creases)]


def _taken(plan: RoofPlan, rims: Sequence[RimEdge], deep_m: float) -> shapely.Geometry:
    """The building itself, and what lies just behind the walls that it shares."""
    local = plan.local()
    rings = _border_polygons(plan, local)
    behind = [
        Polygon([r.start, r.start + deep_m * r.outward, r.end + deep_m * r.outward, r.end]) for r in rims if r.party
    ]
    return shapely.union_all([*rings, *behind])


def _border_polygons(plan: RoofPlan, local: FloatArray) -> list[shapely.Geometry]:
    cells = [Polygon(local[c.rings[0]], [local[r] for r in c.rings[1:]]) for c in plan.cells if c.inside]
    return [shapely.coverage_union_all(cells)]


def _strip(rim: RimEdge, before: RimEdge, after: RimEdge) -> Polygon:
    """The edge moved out, its ends on the extensions of shared walls where there are such."""
    a, b = rim.moved(rim.start), rim.moved(rim.end)
    if before.party and _leaves(before, rim):
        a = _meeting(rim, before.start, before.along, a)
    if after.party and _leaves(rim, after):
        b = _meeting(rim, after.start, after.along, b)
    return Polygon([rim.start, a, b, rim.end])


def _leaves(one: RimEdge, two: RimEdge) -> bool:
    turn = _turn(one, two)
    low, high = np.radians(PARTY_TURN_DEG)
    return bool(low < turn < high)


def _turn(one: RimEdge, two: RimEdge) -> float:
    """Angle to the left from an edge to the next, radians."""
    a, b = one.along, two.along
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _meeting(rim: RimEdge, through: FloatArray, along: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Where the moved edge meets a line."""
    rate = float(along @ rim.outward)
    if abs(rate) < 1e-6:
        return otherwise
    t = (rim.reach - float((through - rim.start) @ rim.outward)) / rate
    return np.asarray(through + t * along)


def _corner(one: RimEdge, two: RimEdge) -> Polygon | None:
    """What lies between the strips of two edges at a corner that points outwards."""
    turn = _turn(one, two)
    if turn <= 0:
        return None
    v, a, b = two.start, one.moved(one.end), two.moved(two.start)
    tip = _meeting(one, b, two.along, a)
    if turn < np.radians(TURN_DEG):  # next to nothing, but a slit if left out
        return Polygon([v, a, b])
    if np.hypot(*(tip - v)) > LONGEST_MITRE * max(one.reach, two.reach) or turn > np.radians(170.0):
        return Polygon([v, a, b])
    return Polygon([v, a, tip, b]).convex_hull


def _crease(plan: RoofPlan, one: RimEdge, two: RimEdge) -> LineString | None:
    """The line from a vertex of the wall on which two roof faces part beyond it."""
    if one.face == two.face:
        return None
    v = two.start
    way = _crease_direction(plan, one, two)
    far = 4.0 * max(one.reach, two.reach) * LONGEST_MITRE
    return LineString([v, v + far * way])


def _crease_direction(plan: RoofPlan, one: RimEdge, two: RimEdge) -> FloatArray:
    middle = _between(one, two)
    step = abs(one.tops[1] - two.tops[0])
    slopes = plan.planes[one.face][:2] - plan.planes[two.face][:2]
    size = float(np.hypot(*slopes))
    if step > SAME_HEIGHT_M or size < SAME_SLOPE:
        return middle
    way = np.array([-slopes[1], slopes[0]]) / size
    way = way if way @ middle > 0 else -way
    if min(way @ one.outward, way @ two.outward) < LEAST_OUTWARD and _turn(one, two) < np.radians(TURN_DEG):
        return middle
    if max(way @ one.outward, way @ two.outward) < LEAST_OUTWARD:
        return middle
    return way


def _between(one: RimEdge, two: RimEdge) -> FloatArray:
    """From the wall's vertex to where the moved edges cross."""
    v = two.start
    tip = _meeting(one, two.moved(two.start), two.along, one.moved(one.end))
    way = tip - v
    length = float(np.hypot(*way))
    if abs(_turn(one, two)) < np.radians(TURN_DEG) or length < 1e-6 or length > 20 * max(one.reach, two.reach):
        way = one.outward + two.outward
        length = float(np.hypot(*way))
    return np.asarray(way / length)


def _cut(part: Polygon, creases: Sequence[LineString]) -> list[Polygon]:
    """A strip cut by the creases that begin on its rim, each up to where it leaves the strip."""
    lines: list[shapely.Geometry] = [part.boundary]
    for crease in creases:
        start = shapely.points(crease.coords[0])
        if shapely.distance(start, part.boundary) > 1e-6:
            continue
        inside = shapely.get_parts(shapely.intersection(crease, part))
        own = [p for p in inside if p.geom_type == "LineString" and shapely.distance(start, p) < 1e-6]
        lines += [_longer(_to_corner(p, part)) for p in own]
    if len(lines) == 1:
        return [part]
    pieces = shapely.get_parts(shapely.polygonize([shapely.union_all(lines)]))
    inner = [p for p in pieces if shapely.contains_xy(part, *shapely.get_coordinates(shapely.point_on_surface(p))[0])]
    return [p for p in inner if p.area > SLIVER_M2 and p.area / p.length > LEAST_WIDTH_M / 2]


def _to_corner(line: LineString, part: Polygon) -> LineString:
    """A line whose end is a corner of the strip where it all but is one: else a very short edge would remain."""
    a, *_, b = shapely.get_coordinates(line)
    corners = shapely.get_coordinates(part)
    apart = np.hypot(*(corners - b).T)
    nearest = int(np.argmin(apart))
    return LineString([a, corners[nearest]]) if apart[nearest] < TO_CORNER_M else LineString([a, b])


def _longer(line: LineString) -> LineString:
    """A line that surely crosses what it ends on, whatever the rounding; what sticks out bounds no polygon."""
    a, *_, b = shapely.get_coordinates(line)
    more = BEYOND_M * (b - a) / max(float(np.hypot(*(b - a))), BEYOND_M)
    return LineString([a - more, b + more])
