"""Coplanar pieces of wall that share a vertical edge become one face."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cityflow.core.arrays import FloatArray

Corner = tuple[int, int]

COPLANAR = 2e-4
"""Ends of wall pieces may lie this far (m) off the common plane; rounding alone moves them by 0.07 mm."""


@dataclass(frozen=True, slots=True)
class Wall:
    """One piece of wall.

    Attributes
    ----------
    ring : corners (vertex in plan, level), counter-clockwise seen from outside
    edge : plan vertices at its base, left to right seen from outside
    outline_edge : number of the outline edge it stands on, −1 for walls between roofs
    """

    ring: tuple[Corner, ...]
    edge: tuple[int, int]
    outline_edge: int


def merge_walls(walls: list[Wall], xy: FloatArray) -> list[tuple[Corner, ...]]:
    """Rings of the walls, coplanar neighbours on the same outline edge or the same line united."""
    owner = {edge: k for k, wall in enumerate(walls) for edge in _edges(wall.ring)}
    leader = list(range(len(walls)))
    for (a, b), k in owner.items():
        other = owner.get((b, a))
        if other is None or a[0] != b[0] or not _one_plane(walls[k], walls[other], xy):
            continue
        first, second = _root(leader, k), _root(leader, other)
        leader[max(first, second)] = min(first, second)
    groups: dict[int, list[int]] = {}
    for k in range(len(walls)):
        groups.setdefault(_root(leader, k), []).append(k)
    rings = []
    for members in groups.values():
        united = _united([walls[k].ring for k in members])
        rings.extend([united] if united is not None else [walls[k].ring for k in members])
    return rings


def _edges(ring: tuple[Corner, ...]) -> list[tuple[Corner, Corner]]:
    return list(zip(ring, [*ring[1:], ring[0]], strict=True))


def _root(leader: list[int], k: int) -> int:
    while leader[k] != k:
        k = leader[k]
    return k


def _one_plane(a: Wall, b: Wall, xy: FloatArray) -> bool:
    if a.outline_edge != b.outline_edge:
        return False
    if a.outline_edge >= 0:
        return True
    (u, v), (p, q) = a.edge, b.edge
    dx, dy = xy[v] - xy[u]
    ex, ey = xy[q] - xy[p]
    if dx * ex + dy * ey <= 0:
        return False
    length = math.hypot(dx, dy)
    return all(abs(dx * (xy[w][1] - xy[u][1]) - dy * (xy[w][0] - xy[u][0])) <= COPLANAR * length for w in (p, q))


def _united(rings: list[tuple[Corner, ...]]) -> tuple[Corner, ...] | None:
    """One ring around all, or None where that would not be a simple ring."""
    if len(rings) == 1:
        return rings[0]
    edges = {edge for ring in rings for edge in _edges(ring)}
    border = sorted((a, b) for a, b in edges if (b, a) not in edges)
    following = dict(border)
    if len(following) != len(border):
        return None
    start = border[0][0]
    ring, corner = [start], following[start]
    while corner != start:
        ring.append(corner)
        corner = following[corner]
    return tuple(ring) if len(ring) == len(border) else None
