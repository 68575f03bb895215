"""From directed boundary edges back to rings, and from rings to cells with holes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

Edge = tuple[int, int]
Ring = list[int]
Coordinates = Sequence[tuple[float, float]]


def ring_area(ring: Sequence[int], xy: Coordinates) -> float:
    """Signed area (m²), positive for a counter-clockwise ring."""
    x0, y0 = xy[ring[0]]
    total = dx = dy = 0.0
    for v in ring[1:]:
        x, y = xy[v]
        last_dx, last_dy, dx, dy = dx, dy, x - x0, y - y0
        total += last_dx * dy - dx * last_dy
    return total / 2


def ring_edges(ring: Sequence[int]) -> list[Edge]:
    """Directed edges of a ring.

    >>> ring_edges([4, 7, 9])
    [(4, 7), (7, 9), (9, 4)]
    """
    return list(pairwise([*ring, ring[0]]))


def inside_rings(x: float, y: float, rings: Iterable[Sequence[int]], xy: Coordinates) -> bool:
    """Even-odd test of a point against an exterior ring and its holes."""
    inside = False
    for ring in rings:
        for u, v in ring_edges(ring):
            (x1, y1), (x2, y2) = xy[u], xy[v]
            if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
                inside = not inside
    return inside


def trace_rings(edges: Iterable[Edge], xy: Coordinates) -> list[Ring]:
    """Closed simple rings with the area on the left of every edge.

    At a vertex with several continuations the first one clockwise from where the ring came is taken, which keeps the
    traced face minimal; a ring that visits a vertex twice is cut there into simple ones.
    """
    following: dict[int, list[int]] = {}
    for u, v in edges:
        following.setdefault(u, []).append(v)
    unused = {(u, v) for u, ends in following.items() for v in ends}
    rings: list[Ring] = []
    for start in [(u, v) for u, ends in following.items() for v in ends]:
        if start not in unused:
            continue
        ring, edge = [], start
        while edge in unused:
            unused.discard(edge)
            ring.append(edge[0])
            edge = (edge[1], _next_vertex(edge, following, xy))
        rings.extend(_simple_parts(ring))
    return rings


def halves(ring: Ring, chord: Edge, xy: Coordinates) -> list[Ring] | None:
    """What `trace_rings` makes of a simple ring and a chord within it; None where the chord lies otherwise."""
    i, j = sorted((ring.index(chord[0]), ring.index(chord[1])))
    first, second = [*ring[: i + 1], *ring[j:]], ring[i : j + 1]
    if min(len(first), len(second)) < 3 or min(ring_area(first, xy), ring_area(second, xy)) <= 0:
        return None
    a, b, after_a, after_b = ring[i], ring[j], ring[i + 1], ring[(j + 1) % len(ring)]
    following = {a: [after_a, b], b: [after_b, a]}
    way = (((ring[i - 1], a), b), ((a, b), after_b), ((ring[j - 1], b), a), ((b, a), after_a))
    if any(_next_vertex(edge, following, xy) != end for edge, end in way):
        return None
    return [first, second] if i else [second, first]


def _next_vertex(edge: Edge, following: dict[int, list[int]], xy: Coordinates) -> int:
    u, v = edge
    ends = following[v]
    if len(ends) == 1:
        return ends[0]
    back = math.atan2(xy[u][1] - xy[v][1], xy[u][0] - xy[v][0])

    def turn(end: int) -> float:
        angle = (back - math.atan2(xy[end][1] - xy[v][1], xy[end][0] - xy[v][0])) % (2 * math.pi)
        return angle if end != u else 2 * math.pi

    return min(ends, key=turn)


def _simple_parts(ring: Ring) -> list[Ring]:
    parts: list[Ring] = []
    path: list[int] = []
    position: dict[int, int] = {}
    for vertex in ring:
        if vertex in position:
            first = position[vertex]
            parts.append(path[first:])
            for passed in path[first:]:
                del position[passed]
            del path[first:]
        position[vertex] = len(path)
        path.append(vertex)
    parts.append(path)
    return [part for part in parts if len(part) > 2]


def group_rings(rings: Sequence[Ring], xy: Coordinates) -> list[list[Ring]]:
    """Cells of exterior ring and holes: each clockwise ring goes to the smallest counter-clockwise one around it."""
    areas = [ring_area(ring, xy) for ring in rings]
    outer = sorted((i for i, area in enumerate(areas) if area > 0), key=lambda i: areas[i])
    cells = {i: [rings[i]] for i in outer}
    for i, area in enumerate(areas):
        if area >= 0:
            continue
        around = next((o for o in outer if _surrounds(rings[o], rings[i], xy)), None)
        if around is not None:
            cells[around].append(rings[i])
    return [cells[i] for i in sorted(outer)]


def _surrounds(outer: Ring, hole: Ring, xy: Coordinates) -> bool:
    # A hole may touch its exterior in a vertex, so that the middle of an edge decides, not a vertex.
    (x1, y1), (x2, y2) = xy[hole[0]], xy[hole[1]]
    return inside_rings((x1 + x2) / 2, (y1 + y2) / 2, [outer], xy)
