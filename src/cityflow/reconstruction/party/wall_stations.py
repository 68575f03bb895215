"""Two walls on one plan edge: common places along the edge, with nearly equal heights made equal.

Everything is found once for both walls, from both profiles alike, so that neither can see it differently.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from cityflow.core.building import VERTEX_DECIMALS
from cityflow.reconstruction.party.wall_profiles import Plan, Profile, Stack, height_between
from cityflow.reconstruction.solids.tied_heights import TIED, settled

BEND, MOST_BEND = 0.1, 0.3
"""A straight edge is bent towards a vertex of the other wall by no more than this share of the way to its next end,
since the roof beside it turns; by the greater share up to `CLOSE`; set by hand, as are those below."""

CLOSE = 0.002
"""A vertex this near (m) to the other wall's edge is better on it: two vertices within 1 mm count as one."""

NEAR = 0.01
"""Single vertices at heights that tie, such as two ridges, are one if no farther apart than this (m) along the edge."""

Heights = tuple[float, ...]
Settlements = Mapping[Plan, Mapping[float, float]]


@dataclass(frozen=True, slots=True)
class Side:
    """One wall at a station.

    Attributes
    ----------
    before, after : heights of its profile on both sides of the station
    heights : those of its vertices there, in the order of the profile; none where the profile passes straight
    stack : its vertices there as they were, if it had any
    targets : what becomes of the height of each of these
    """

    before: float
    after: float
    heights: Heights = ()
    stack: Stack | None = None
    targets: Heights = ()


@dataclass(frozen=True, slots=True)
class Station:
    """A place along the edge where one of the walls bends or jumps, or where they cross."""

    s: float
    plan: Plan
    sides: tuple[Side, Side]


def stations_of(first: Profile, second: Profile, corners: Settlements) -> list[Station]:
    """All stations, from the start to the end of the edge.

    Parameters
    ----------
    first, second : the walls, both from the same end
    corners : for both ends, what becomes of the heights there
    """
    places = [_place(a, b, corners) for a, b in _matched(first, second)]
    for side in (0, 1):
        places = _filled(places, side)
    stations = [Station(s, plan, (a, b)) for s, plan, (a, b) in places if a is not None and b is not None]
    crossings = [c for a, b in itertools.pairwise(stations) if (c := _crossing(a, b, stations)) is not None]
    return sorted([*stations, *crossings], key=lambda station: station.s)


Place = tuple[float, Plan, tuple[Side | None, Side | None]]


def _matched(first: Profile, second: Profile) -> list[tuple[Stack | None, Stack | None]]:
    """Stacks of both walls in their order; those that are mutually nearest, and near enough, are together."""
    inner = [first[1:-1], second[1:-1]]
    nearest = [[_nearest(stack, inner[1 - k]) for stack in inner[k]] for k in (0, 1)]
    together = {i: j for i, j in enumerate(nearest[0]) if j >= 0 and nearest[1][j] == i}
    pairs: list[tuple[Stack | None, Stack | None]] = [
        (a, inner[1][together[i]] if i in together else None) for i, a in enumerate(inner[0])
    ]
    pairs += [(None, b) for j, b in enumerate(inner[1]) if j not in together.values()]
    pairs.sort(key=lambda pair: sum(p.s for p in pair if p) / sum(p is not None for p in pair))
    return [(first[0], second[0]), *pairs, (first[-1], second[-1])]


def _nearest(stack: Stack, others: Sequence[Stack]) -> int:
    close = [(abs(other.s - stack.s), k) for k, other in enumerate(others) if _may_be_one(stack, other)]
    return min(close)[1] if close else -1


def _may_be_one(a: Stack, b: Stack) -> bool:
    alike = len(a.heights) == len(b.heights) == 1 and abs(a.heights[0] - b.heights[0]) <= TIED
    return abs(a.s - b.s) <= (NEAR if alike else TIED)


def _place(a: Stack | None, b: Stack | None, corners: Settlements) -> Place:
    known = [stack for stack in (a, b) if stack is not None]
    s = sum(stack.s for stack in known) / len(known)
    x, y = (sum(stack.plan[axis] for stack in known) / len(known) for axis in (0, 1))
    plan = known[0].plan if known[0].plan == known[-1].plan else _rounded(x, y)
    settlement = corners.get(plan)
    if settlement is None:
        settlement = settled(z for stack in known for z in stack.heights) if len(known) > 1 else {}
    sides = [None if stack is None else _side(stack, settlement) for stack in (a, b)]
    return s, plan, (sides[0], sides[1])


def _rounded(x: float, y: float) -> Plan:
    return round(x, VERTEX_DECIMALS), round(y, VERTEX_DECIMALS)


def _side(stack: Stack, settlement: Mapping[float, float]) -> Side:
    targets = tuple(settlement.get(z, z) for z in stack.heights)
    heights = tuple(z for z, _ in itertools.groupby(targets))
    return Side(heights[0], heights[-1], heights, stack, targets)


def _filled(places: list[Place], side: int) -> list[Place]:
    """Places with the given wall's height where it passes straight; with a vertex where the other wall meets it."""
    known = [(s, sides[side]) for s, _, sides in places]
    filled: list[Place] = []
    for k, (s, plan, sides) in enumerate(places):
        here = sides[side]
        if here is None:
            before = next((t, p.after) for t, p in reversed(known[:k]) if p is not None)
            following = next((t, p.before) for t, p in known[k + 1 :] if p is not None)
            tolerance = _bend_within(min(s - before[0], following[0] - s))
            here = _passing(height_between(before, following, s), sides[1 - side], tolerance)
        filled.append((s, plan, (here, sides[1]) if side == 0 else (sides[0], here)))
    return filled


def _bend_within(way: float) -> float:
    return min(TIED, max(BEND * way, min(CLOSE, MOST_BEND * way)))


def _passing(z: float, other: Side | None, tolerance: float) -> Side:
    heights = other.heights if other is not None else ()
    distance, nearest = min((abs(h - z), h) for h in heights)
    if distance <= tolerance:
        return Side(nearest, nearest, (nearest,))
    if min(heights) < z < max(heights):
        z = round(z, VERTEX_DECIMALS)
        return Side(z, z, (z,))
    return Side(z, z)


def _crossing(a: Station, b: Station, stations: Sequence[Station]) -> Station | None:
    start = a.sides[0].after - a.sides[1].after
    end = b.sides[0].before - b.sides[1].before
    if start * end >= 0:
        return None
    s = a.s + start / (start - end) * (b.s - a.s)
    lines = [height_between((a.s, p.after), (b.s, q.before), s) for p, q in zip(a.sides, b.sides, strict=True)]
    z = round(sum(lines) / 2, VERTEX_DECIMALS)
    t = s / stations[-1].s
    (x0, y0), (x1, y1) = stations[0].plan, stations[-1].plan
    side = Side(z, z, (z,))
    return Station(s, _rounded(x0 + t * (x1 - x0), y0 + t * (y1 - y0)), (side, replace(side)))
