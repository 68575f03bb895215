"""Rings with some straight edges moved inwards; parts shared with neighbours stay."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.geometry.ring_vertices import on_lattice, with_vertices
from cityflow.geometry.straight_edges import WallEdge

CORNER_FACTOR, CORNER_M = 4.0, 0.3
"""A corner moves no farther than so many times what its edges move, and this; set by hand, as are those below."""
LEAST_LENGTH_M = 0.3
"""What is left of an edge is at least so long."""
TURN_DEG = 15.0
"""Edges that turn less have no corner that could slide."""
ON_LINE_M, TIE_M = 1e-9, 1e-3
"""Rounding, and how near vertices of neighbours lie on an edge."""
TOGETHER_M = 0.05
"""Corners on a shared wall that are nearer to each other are one, as when outlines are noded."""


def ring_moved(edges: Sequence[WallEdge], moves: Sequence[float]) -> FloatArray | None:
    """(n, 2) the ring whose edges stand `moves` metres farther inside; None where they do not meet.

    Corners between two edges that move are where their new lines meet. A corner with an edge that stays slides along that edge, which keeps all
    its other vertices bit for bit; at an inner corner the edge that stays is extended.

    Parameters
    ----------
    edges : all of one ring, in its direction
    moves : metres inwards, 0 for those that stay
    """
    if len(edges) < 3:
        return None
    lines = [e.xy if m == 0 else e.xy[[0, -1]] - m * e.outward for e, m in zip(edges, moves, strict=True)]
    for k in range(len(edges)):
        if moves[k - 1] == 0 and moves[k] == 0:
            continue
        joined = _corner(edges[k - 1], edges[k], lines[k - 1], lines[k], (moves[k - 1], moves[k]))
        if joined is None:
            return None
        lines[k - 1], lines[k] = joined
    left = [float((line[-1] - line[0]) @ e.along) for line, e in zip(lines, edges, strict=True)]
    changed = [
        k for k in range(len(edges)) if moves[k] or moves[k - 1] or moves[(k + 1) % len(edges)]
    ]  # short edges that nobody touches may be there already
    if any(left[k] < LEAST_LENGTH_M for k in changed):
        return None
    ring = np.concatenate([line[:-1] for line in lines])
    return _without_repeats(ring)


def _corner(
    before: WallEdge, after: WallEdge, first: FloatArray, second: FloatArray, moves: tuple[float, float]
) -> tuple[FloatArray, FloatArray] | None:
    """The two lines, up to the vertex in which they meet now."""
    turn = before.along[0] * after.along[1] - before.along[1] * after.along[0]
    if abs(turn) < np.sin(np.radians(TURN_DEG)):
        return None
    if moves[0] and moves[1]:
        place = _meeting(first[0], before.along, second[0], after.along)
        first, second = np.vstack([first[0], place]), np.vstack([place, second[-1]])
    elif moves[0]:
        second = _cut(second, first[0], before.along)
        place = second[0]
        first = np.vstack([first[0], place])
    else:
        first = _cut(first[::-1], second[0], after.along)[::-1]
        place = first[-1]
        second = np.vstack([place, second[-1]])
    far = float(np.hypot(*(place - after.start)))
    return (first, second) if far <= CORNER_FACTOR * max(moves) + CORNER_M else None


def _meeting(a: FloatArray, along: FloatArray, b: FloatArray, other: FloatArray) -> FloatArray:
    """Where two lines meet, on the lattice of vertices."""
    turn = along[0] * other[1] - along[1] * other[0]
    off = b - a
    return on_lattice(a + along * ((off[0] * other[1] - off[1] * other[0]) / turn))


def _cut(line: FloatArray, through: FloatArray, along: FloatArray) -> FloatArray:
    """A polyline from where it crosses a line on; begun earlier, in its own direction, where the line passes before its first vertex."""
    normal = np.array([along[1], -along[0]])
    off = (line - through) @ normal
    side = np.sign(off[-1])
    beyond = np.flatnonzero(side * off <= ON_LINE_M)
    k = int(beyond[-1]) if len(beyond) else 0
    k = min(k, len(line) - 2)
    way = line[k + 1] - line[k]
    place = _meeting(line[k], way / np.hypot(*way), through, along)
    kept = line[k + 1 :] if len(beyond) else line
    if np.array_equal(place, kept[0]):
        return kept if len(kept) > 1 else line[k:]
    return np.vstack([place, kept])


def polygon_of(rings: Sequence[FloatArray]) -> Polygon | None:
    """The polygon, if it is valid: the exterior first, counter-clockwise."""
    if any(len(r) < 3 for r in rings):
        return None
    made = shapely.orient_polygons(Polygon(rings[0], rings[1:]), exterior_cw=False)
    return made if made.is_valid and made.area > 0 else None


def noded_again(before: Sequence[Polygon], moved: Sequence[Polygon]) -> list[Polygon | None]:
    """Polygons whose new corners on shared walls are vertices of both neighbours, and one where they are nearly one; None for those that this spoils.

    Parameters
    ----------
    before : noded, as they were;  moved : the very same objects where nothing moved
    """
    changed = [k for k, (a, b) in enumerate(zip(before, moved, strict=True)) if a is not b]
    tree = shapely.STRtree(list(before))
    beside = {k: sorted(tree.query(before[k], predicate="dwithin", distance=TIE_M).tolist()) for k in changed}
    place = _snapped(
        {k: _fresh(before[k], moved[k]) for k in changed}, {k: _kept(before, moved, near) for k, near in beside.items()}
    )
    result: list[Polygon | None] = list(moved)
    for k in changed:
        rings = [shapely.get_coordinates(r)[:-1] for r in (moved[k].exterior, *moved[k].interiors)]
        result[k] = polygon_of(
            [_without_repeats(np.array([place[k].get(tuple(v), tuple(v)) for v in ring.tolist()])) for ring in rings]
        )
    for other in sorted({n for near in beside.values() for n in near}):
        own = result[other]
        new = [v for k in changed if other != k and other in beside[k] for v in place[k].values()]
        if own is not None and new:
            result[other] = with_vertices(own, np.array(new).reshape(-1, 2), TIE_M)
    return result


_Vertex = tuple[float, ...]


def _fresh(before: Polygon, moved: Polygon) -> list[_Vertex]:
    known = set(map(tuple, shapely.get_coordinates(before).tolist()))
    return [v for v in dict.fromkeys(map(tuple, shapely.get_coordinates(moved).tolist())) if v not in known]


def _kept(before: Sequence[Polygon], moved: Sequence[Polygon], near: Sequence[int]) -> FloatArray:
    """(n, 2) vertices around that stand where they stood."""
    return np.array(
        [v for k in near for v in set(map(tuple, shapely.get_coordinates(before[k]).tolist())) & set(map(tuple, shapely.get_coordinates(moved[k]).tolist()))]
    ).reshape(-1, 2)  # fmt: skip


def _snapped(fresh: dict[int, list[_Vertex]], kept: dict[int, FloatArray]) -> dict[int, dict[_Vertex, _Vertex]]:
    """Where each new vertex of each polygon stands: on an old one that is near, in the middle of new ones that are, or where it is."""
    every = sorted({v for own in fresh.values() for v in own})
    tree = shapely.STRtree(shapely.points(np.array(every).reshape(-1, 2)))
    found: dict[int, dict[_Vertex, _Vertex]] = {}
    for k, own in fresh.items():
        found[k] = {}
        for v in own:
            away = np.hypot(*(kept[k] - v).T) if len(kept[k]) else np.empty(0)
            if len(away) and away.min() <= TOGETHER_M:
                nearest = kept[k][np.lexsort((*kept[k].T, away))[0]]
                found[k][v] = tuple(nearest.tolist())
                continue
            near = np.sort(tree.query(shapely.Point(v), predicate="dwithin", distance=TOGETHER_M))
            found[k][v] = tuple(on_lattice(np.mean([every[n] for n in near], axis=0)).tolist())
    return found


def _without_repeats(ring: FloatArray) -> FloatArray:
    return ring[~np.all(ring == np.roll(ring, 1, axis=0), axis=1)]
