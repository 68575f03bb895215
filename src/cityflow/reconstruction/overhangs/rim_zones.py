"""The strip of roof beyond the walls in plan, cut where the planes of neighbouring roof faces meet in it.

Every edge of the outline is moved out by its reach; edges meet where their moved lines cross. A ridge, hip or valley that ends
at the wall runs on into the strip along the line in which its two planes intersect, so that both go on undisturbed. Corners of
the rim are moved onto such lines by the little that reaches are uncertain. At a step the higher roof's rim goes on straight.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.overhangs.creases import TURN_DEG, Crease, corners_on_creases, crease_of, up_to_corners
from cityflow.reconstruction.overhangs.rim_edges import RimEdge, meeting, turn_between
from cityflow.reconstruction.overhangs.roof_plan import RoofPlan

LONGEST_MITRE = 3.0
"""A corner reaches out by no more than so many times the greater reach of its edges; sharper ones are cut off; set by hand."""
PARTY_TURN_DEG = (40.0, 140.0)
"""Where a wall shared with a neighbour leaves the façade under such an angle, the roof ends on its extension; set by hand."""
SLIVER_M2 = 1e-4
"""Zones that are smaller,"""
LEAST_WIDTH_M = 2e-3
"""or narrower, are rounding."""
BEYOND_M = 1e-5
"""Lines are drawn out by this so that they cut through; rounding."""
STRAIGHT_M, NOT_ALONG_M, SAME_START_M = 5e-4, 1e-4, 1e-3
"""Vertices so near a line lie on it, lines so near a border run along it, and ends so near are one; rounding."""
SAME_PLACE_M = 0.02
"""A corner of the rim is found again this far away: short pieces of an outline point where rounding lets them."""
TO_CORNER_M = 0.03
"""A cut that ends so near a corner ends in it; set by hand."""


def rim_zones(plan: RoofPlan, rims: Sequence[RimEdge], deep_m: float) -> list[Polygon]:
    """Polygons, local to the plan's origin, that together are the roof beyond the walls; each belongs to one roof face.

    Parameters
    ----------
    deep_m : so deep beyond a shared wall is the neighbour
    """
    by_start = {rim.ends[0]: rim for rim in rims}
    by_end = {rim.ends[1]: rim for rim in rims}
    building = _building(plan)
    far_m = 4.0 * LONGEST_MITRE * max((rim.reach for rim in rims), default=0.0)
    strips: list[shapely.Geometry] = []
    creases: list[Crease] = []
    for rim in (r for r in rims if r.reach > 0):
        following = by_start[rim.ends[1]]
        strips.append(_strip(rim, by_end[rim.ends[0]], following))
        if following.reach > 0:
            corner, crease = _corner(rim, following), crease_of(plan, rim, following, building, far_m)
            strips += [corner] if corner is not None else []
            creases += [crease] if crease is not None else []
    if not strips:
        return []
    zone = shapely.difference(shapely.union_all(strips), _taken(building, rims, deep_m))
    moved = corners_on_creases(rims, creases)
    creases = up_to_corners(creases, moved)
    parts = [p for p in shapely.get_parts(zone) if p.geom_type == "Polygon" and p.area > SLIVER_M2]
    return [piece for part in parts for piece in _cut(_with_corners(part, moved, building), creases)]


def _with_corners(part: Polygon, moved: Sequence[tuple[FloatArray, FloatArray]], building: shapely.Geometry) -> Polygon:
    """The part with corners of its rim moved; the rims beside them stay straight."""
    walls = shapely.boundary(building)
    rings = [_rim_moved(shapely.get_coordinates(r)[:-1], moved, walls) for r in (part.exterior, *part.interiors)]
    if not moved or min(len(r) for r in rings) < 3:
        return part
    changed = Polygon(rings[0], rings[1:])
    return changed if changed.is_valid else part


def _rim_moved(xy: FloatArray, moved: Sequence[tuple[FloatArray, FloatArray]], walls: shapely.Geometry) -> FloatArray:
    """A ring without the vertices within straight rims, its corners where they belong."""
    before, after = np.roll(xy, 1, axis=0), np.roll(xy, -1, axis=0)
    on_line = shapely.distance(shapely.points(xy), shapely.linestrings(np.stack([before, after], axis=1))) < STRAIGHT_M
    kept = xy[~on_line | (shapely.distance(shapely.points(xy), walls) < SAME_PLACE_M)]
    for tip, place in moved:
        kept = np.where((np.hypot(*(kept - tip).T) < SAME_PLACE_M)[:, None], place, kept)
    return kept


def _taken(building: shapely.Geometry, rims: Sequence[RimEdge], deep_m: float) -> shapely.Geometry:
    """The building itself, and what lies just behind the walls that it shares."""
    behind = [
        Polygon([r.start, r.start + deep_m * r.outward, r.end + deep_m * r.outward, r.end]) for r in rims if r.party
    ]
    return shapely.union_all([building, *behind])


def _building(plan: RoofPlan) -> shapely.Geometry:
    local = plan.local()
    cells = [Polygon(local[c.rings[0]], [local[r] for r in c.rings[1:]]) for c in plan.cells if c.inside]
    return shapely.coverage_union_all(cells)


def _strip(rim: RimEdge, before: RimEdge, after: RimEdge) -> Polygon:
    """The edge moved out, its ends on the extensions of shared walls where there are such."""
    a, b = rim.moved(rim.start), rim.moved(rim.end)
    if before.party and _leaves(before, rim):
        a = meeting(rim, before.start, before.along, a)
    if after.party and _leaves(rim, after):
        b = meeting(rim, after.start, after.along, b)
    return Polygon([rim.start, a, b, rim.end])


def _leaves(one: RimEdge, two: RimEdge) -> bool:
    turn = turn_between(one, two)
    low, high = np.radians(PARTY_TURN_DEG)
    return bool(low < turn < high)


def _corner(one: RimEdge, two: RimEdge) -> Polygon | None:
    """What lies between the strips of two edges at a corner that points outwards."""
    turn = turn_between(one, two)
    if turn <= 0:
        return None
    v, a, b = two.start, one.moved(one.end), two.moved(two.start)
    tip = meeting(one, b, two.along, a)
    if turn < np.radians(TURN_DEG):  # next to nothing, but a slit if left out
        return Polygon([v, a, b])
    if np.hypot(*(tip - v)) > LONGEST_MITRE * max(one.reach, two.reach) or turn > np.radians(170.0):
        return Polygon([v, a, b])
    return Polygon([v, a, tip, b]).convex_hull


def _cut(part: Polygon, creases: Sequence[Crease]) -> list[Polygon]:
    """A strip cut by the creases that begin at its wall, each up to where it leaves the strip.

    Beyond a step the rim of its lower edge is a cut too: what lies behind it is no part of that edge's strip, but of the roof that it touches most.
    """
    lines: list[shapely.Geometry] = [part.boundary]
    for crease in creases:
        start = shapely.Point(crease.start)
        if shapely.distance(start, part.boundary) > 1e-6:
            continue
        inside = shapely.get_parts(shapely.intersection(crease.line, part))
        own = [p for p in inside if p.geom_type == "LineString" and shapely.distance(start, p) < 1e-6]
        lines += [_to_corners(_longer(p), part) for p in own]
        lines += [] if crease.lower_rim is None else _within(crease.lower_rim, part)
    if len(lines) == 1:
        return [part]
    pieces = shapely.get_parts(shapely.polygonize([shapely.union_all(lines)]))
    inner = [p for p in pieces if shapely.contains_xy(part, *shapely.get_coordinates(shapely.point_on_surface(p))[0])]
    return [p for p in inner if p.area > SLIVER_M2 and p.area / p.length > LEAST_WIDTH_M / 2]


def _to_corners(line: LineString, part: Polygon) -> LineString:
    """A line with its ends in corners of the strip where they all but are: else very short edges would remain, or slits."""
    ends = shapely.get_coordinates(line)[[0, -1]]
    corners = shapely.get_coordinates(part)
    apart = np.hypot(*(corners[None] - ends[:, None]).transpose(2, 0, 1))
    near = np.min(apart, axis=1) < (SAME_START_M, TO_CORNER_M)
    return LineString(np.where(near[:, None], corners[np.argmin(apart, axis=1)], ends))


def _within(line: LineString, part: Polygon) -> list[LineString]:
    """The pieces of a line that lead through a strip, not along its border."""
    apart = shapely.difference(shapely.intersection(line, part), shapely.buffer(part.boundary, NOT_ALONG_M))
    pieces = [p for p in shapely.get_parts(apart) if isinstance(p, LineString) and p.length > 0]
    return [_to_corners(_longer(p, 3 * NOT_ALONG_M), part) for p in pieces]


def _longer(line: LineString, by_m: float = BEYOND_M) -> LineString:
    """A line that surely crosses what it ends on, whatever the rounding; what sticks out bounds no polygon."""
    a, *_, b = shapely.get_coordinates(line)
    more = by_m * (b - a) / max(float(np.hypot(*(b - a))), BEYOND_M)
    return LineString([a - more, b + more])
