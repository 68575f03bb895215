"""Two walls on one plan edge, compared: nodes along the edge, and who is higher between them.

A wall over one outline edge is the area between a level floor and a profile of roof heights. Both walls are described
by positions along the edge in one direction, so that both units find the same nodes and crossings.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from cityflow.core.building import VERTEX_DECIMALS

TIED = 0.003
"""Heights and positions that differ by less than this (m) make no piece of wall of their own."""


@dataclass(frozen=True, slots=True)
class Profile:
    """A wall's outline over its floor, from the start to the end of the plan edge.

    Attributes
    ----------
    points : (s, x, y, z, vertex): position along the edge, world coordinates, vertex number; the first and the last
        are on the floor, s never decreases by more than rounding
    """

    points: tuple[tuple[float, float, float, float, int], ...]

    @property
    def floor(self) -> float:
        return self.points[0][3]


@dataclass(frozen=True, slots=True)
class Spot:
    """A place of a wall: node along the edge, and world coordinates; `vertex` where the wall's solid has it already."""

    node: int
    x: float
    y: float
    z: float
    vertex: int = -1


@dataclass(frozen=True, slots=True)
class Node:
    """One position along the edge.

    Attributes
    ----------
    s : metres from the start of the edge
    own : the wall's own spots there, in the order of its profile
    before, after : heights of the own profile just before and after; `other_before`, `other_after` of the other one
    x, y : plan position of new vertices of the own wall
    """

    s: float
    own: tuple[Spot, ...]
    before: float
    after: float
    other_before: float
    other_after: float
    x: float
    y: float


def profile_of(ring: list[int], xyz: list[tuple[float, float, float]], start: tuple[float, float]) -> Profile | None:
    """The profile of a wall from the end of its foot that lies at `start`; None where it is not a simple profile.

    Parameters
    ----------
    ring : vertex numbers, the two vertices of the foot first, counter-clockwise seen from outside
    xyz : world coordinates of all vertices
    """
    around = [ring[0], *reversed(ring[2:]), ring[1]]
    if xyz[around[0]][:2] != start:
        around.reverse()
    (x0, y0, _), (x1, y1, _) = xyz[around[0]], xyz[around[-1]]
    length = math.hypot(x1 - x0, y1 - y0)
    points = []
    for vertex in around:
        x, y, z = xyz[vertex]
        s = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / length
        points.append((0.0 if (x, y) == (x0, y0) else length if (x, y) == (x1, y1) else s, x, y, z, vertex))
    rising = all(b[0] >= a[0] - 1e-3 for a, b in itertools.pairwise(points))
    return Profile(tuple(points)) if rising else None


def compare(own: Profile, other: Profile) -> list[Node]:
    """Nodes where either profile bends or jumps, or where they cross."""
    positions = _clustered([p[0] for p in own.points] + [p[0] for p in other.points], own.points[-1][0])
    nodes = [_node(k, s, own, other) for k, s in enumerate(positions)]
    crossings = [c for a, b in itertools.pairwise(nodes) if (c := _crossing(a, b, own)) is not None]
    ordered = sorted([*nodes, *crossings], key=lambda node: node.s)
    return [_renumbered(node, k) for k, node in enumerate(ordered)]


def _clustered(positions: list[float], length: float) -> list[float]:
    kept = [0.0]
    for s in sorted(positions):
        if s - kept[-1] > TIED and length - s > TIED:
            kept.append(s)
    return [*kept, length]


def _node(k: int, s: float, own: Profile, other: Profile) -> Node:
    mine, theirs = _at(own, s), _at(other, s)
    before, after = _limits(own, s, mine)
    other_before, other_after = _limits(other, s, theirs)
    x, y = (mine or theirs)[0][1:3]
    spots = tuple(Spot(k, *p[1:4], p[4]) for p in mine)
    return Node(s, spots, before, after, other_before, other_after, x, y)


def _at(profile: Profile, s: float) -> list[tuple[float, float, float, float, int]]:
    length = profile.points[-1][0]
    near_end = s == length
    return [
        p
        for p in profile.points
        if (length - p[0] <= TIED if near_end else -1e-3 <= p[0] - s <= TIED and length - p[0] > TIED)
    ]


def _limits(profile: Profile, s: float, spots: list[tuple[float, float, float, float, int]]) -> tuple[float, float]:
    if spots:
        return spots[0][3], spots[-1][3]
    for a, b in itertools.pairwise(profile.points):
        if a[0] <= s <= b[0] and b[0] > a[0]:
            z = a[3] + (s - a[0]) / (b[0] - a[0]) * (b[3] - a[3])
            return z, z
    return profile.points[-1][3], profile.points[-1][3]


def _crossing(a: Node, b: Node, own: Profile) -> Node | None:
    start, end = a.after - a.other_after, b.before - b.other_before
    if start * end >= 0 or max(abs(start), abs(end)) <= TIED:
        return None
    # Both units compute this from the same four heights; the order of the operands must not matter either.
    t = abs(start) / (abs(start) + abs(end))
    s = a.s + t * (b.s - a.s)
    if s - a.s <= TIED or b.s - s <= TIED:
        return None
    (_, x0, y0, _, _), (length, x1, y1, _, _) = own.points[0], own.points[-1]
    x, y = x0 + s / length * (x1 - x0), y0 + s / length * (y1 - y0)
    low, high = sorted(h + t * (g - h) for h, g in ((a.after, b.before), (a.other_after, b.other_before)))
    z = round((low + high) / 2, VERTEX_DECIMALS)
    return Node(s, (), z, z, z, z, round(x, VERTEX_DECIMALS), round(y, VERTEX_DECIMALS))


def _renumbered(node: Node, k: int) -> Node:
    spots = tuple(Spot(k, p.x, p.y, p.z, p.vertex) for p in node.own)
    return Node(node.s, spots, node.before, node.after, node.other_before, node.other_after, node.x, node.y)
