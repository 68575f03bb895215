"""Source and accuracy of each edge of an outline: façade points, or the edge of the roof."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import OutlineEdge
from cityflow.outlines.from_walls.wall_line import WallLine

_ASIDE_M = 0.25
"""A wall beside an edge is no farther from it; set by hand on synthetic towns, as are those below."""
_PARALLEL_COS = np.cos(np.radians(6.0))
"""And turned no more."""
_LEAST_SEEN = 0.1
"""Share of an edge along which a wall is seen, at least."""
_INSIDE_M = 0.4
"""Inner walls stand so far inside."""
_LEAST_INNER_M = 1.0
"""And are at least so long."""
_CELLS_TOGETHER = 3.0
"""Cells beside one another err alike: of so many, one counts."""


class KnownLines:
    """Walls, and boundary points of regions, to look an edge up in.

    Parameters
    ----------
    walls : Sequence[WallLine]
    boundary : (n, 2) points on the boundaries of building regions, world metres
    cell : metres
    """

    def __init__(self, walls: Sequence[WallLine], boundary: FloatArray, cell: float) -> None:
        parts = [(np.array(p), np.array(q), w) for w in walls for p, q in pairwise(shapely.get_coordinates(w.line))]
        self._walls = list(walls)
        self._owner = [w for _, _, w in parts]
        self._ends = np.array([(p, q) for p, q, _ in parts]).reshape(-1, 2, 2)
        self._tree = shapely.STRtree(shapely.linestrings(self._ends))
        self._lines = shapely.STRtree([w.line for w in walls])
        self._boundary, self._cell = boundary, cell
        self._points = shapely.STRtree(shapely.points(boundary))

    def edges_of(self, polygon: Polygon) -> tuple[OutlineEdge, ...]:
        """Every edge of all rings, the exterior's first, the inside on the left."""
        rings = [shapely.get_coordinates(r) for r in (polygon.exterior, *polygon.interiors)]
        return tuple(self._edge(a, b) for ring in rings for a, b in pairwise(ring))

    def seen_share(self, polygon: Polygon) -> float:
        """Share of its border along which façade points stand, seen from outside."""
        edges = self.edges_of(polygon)
        return float(sum(e.seen * e.line.length for e in edges) / max(polygon.length, 1e-9))

    def inner_edges_of(self, polygon: Polygon) -> tuple[OutlineEdge, ...]:
        """Walls within the polygon, the lower side on the right."""
        core = shapely.buffer(polygon, -_INSIDE_M)
        found = []
        for number in sorted(self._lines.query(core, predicate="intersects").tolist()):
            wall = self._walls[number]
            for part in shapely.get_parts(shapely.intersection(wall.line, core)):
                if isinstance(part, LineString) and part.length >= _LEAST_INNER_M:
                    whole = shapely.intersection(wall.line, shapely.buffer(part, 1.1 * _INSIDE_M))
                    kept = whole if isinstance(whole, LineString) else part
                    found.append(OutlineEdge(kept, "wall", wall.sigma_m, float(wall.seen)))
        return tuple(found)

    def _edge(self, a: FloatArray, b: FloatArray) -> OutlineEdge:
        line = LineString([a, b])
        seen, sigma = self._seen(a, b, line)
        if seen >= _LEAST_SEEN:
            return OutlineEdge(line, "wall", sigma, seen)
        return OutlineEdge(line, "roof", self._sigma_of_roof(a, b, line), seen)

    def _seen(self, a: FloatArray, b: FloatArray, line: LineString) -> tuple[float, float]:
        """Share of the edge before which façade points stand, and standard deviation of the wall that covers most."""
        length = max(line.length, 1e-9)
        d = (b - a) / length
        covered, most, sigma = [], 0.0, float("nan")
        for number in sorted(self._tree.query(line, predicate="dwithin", distance=_ASIDE_M).tolist()):
            p, q = self._ends[number]
            e = (q - p) / max(float(np.hypot(*(q - p))), 1e-9)
            s, t = sorted(((p - a) @ d, (q - a) @ d))
            s, t = max(s, 0.0), min(t, length)
            aside = abs(((p + q) / 2 - a) @ np.array([d[1], -d[0]]))
            if e @ d < _PARALLEL_COS or t <= s or aside > _ASIDE_M + (t - s) * 0.1:
                continue
            covered.append((s, t, self._owner[number].seen))
            if t - s > most:
                most, sigma = t - s, self._owner[number].sigma_m
        return float(min(_joined_length(covered) / length, 1.0)), float(sigma)

    def _sigma_of_roof(self, a: FloatArray, b: FloatArray, line: LineString) -> float:
        length = max(line.length, 1e-9)
        d = (b - a) / length
        near = self._boundary[np.sort(self._points.query(line, predicate="dwithin", distance=1.5 * self._cell))]
        s = (near - a) @ d
        near = near[(s > 0.1 * length) & (s < 0.9 * length)]
        if len(near) < 3:
            return float("nan")
        aside = (near - a) @ np.array([d[1], -d[0]])
        spread = 1.4826 * float(np.median(np.abs(aside - np.median(aside))))
        return float(np.hypot(spread / np.sqrt(max(len(near) / _CELLS_TOGETHER, 1.0)), 0.1 * self._cell))


def _joined_length(intervals: list[tuple[float, float, float]]) -> float:
    """Length that intervals (begin, end, share seen) cover together."""
    total, reached = 0.0, 0.0
    for s, t, share in sorted(intervals):
        total += max(t - max(s, reached), 0.0) * share
        reached = max(reached, t)
    return total
