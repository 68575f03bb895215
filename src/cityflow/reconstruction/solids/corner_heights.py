"""Heights of cells at the vertices of a partition, made fit for a closed solid.

Three things are put right before walls are built: heights at a vertex that differ by millimetres become one;
edges along which two roofs cross get a vertex at the crossing; and a vertex around which roofs are high, low, high, low
loses the corner of one low cell, since four walls must not meet in one vertical edge (ISO 19107: a solid's shell is a
2-manifold).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.partition.subdivision import MIN_EDGE, Subdivision
from cityflow.reconstruction.solids.ring_tracing import Edge

SAME_HEIGHT = 12e-3
"""Heights at a vertex that differ by no more than this (m) become their mean: faces stay planar within 6 mm; set by hand, as are those below."""

SAME_SLOPE = 0.1
"""Nor may they differ by more than this part of the shortest edge there, so that small faces are not tilted."""

NO_WALL = 1e-3
"""Heights nearer than this (m) are one whatever the edges: vertices would fall together in a reader's eyes."""

CORNER = 0.05
"""Legs (m) of the corner that a cell loses where four walls would meet."""

S = TypeVar("S")
"""Whose a height is."""

OUTSIDE = -1
"""Number of the cell outside the outline."""


class CornerHeights:
    """Which level each cell has at each of its vertices; level 0 is the floor at the outline's vertices.

    Attributes
    ----------
    level : (vertex, cell) → position of the height among the vertex's `levels`
    levels : vertex → increasing heights (m)
    """

    def __init__(self, division: Subdivision, planes: dict[int, FloatArray], floor: float) -> None:
        self.division, self.planes, self.floor = division, planes, floor
        self.level: dict[tuple[int, int], int] = {}
        self.levels: dict[int, list[float]] = {}
        self.sectors: dict[int, list[int]] = {}
        self.shortest: dict[int, float] = {}
        self.tied: dict[int, list[tuple[int, int]]] = {}
        self.refresh()

    def refresh(self) -> None:
        """Levels of all vertices anew."""
        self.level.clear()
        self.levels.clear()
        self.sectors = _cells_around(self.division)
        self.shortest = _shortest_edges(self.division)
        for vertex in sorted(self.sectors):
            self._cluster(vertex, list(dict.fromkeys(self.sectors[vertex])))

    def _cluster(self, vertex: int, cells: list[int]) -> None:
        x, y = self.division.xy[vertex]
        heights = []
        for cell in cells:
            a, b, c = (0.0, 0.0, self.floor) if cell == OUTSIDE else self.planes[cell]
            heights.append((float(a * x + b * y + c), cell))
        groups = tied_groups(heights, self.shortest[vertex], self.tied.get(vertex, []))
        self.levels[vertex] = [sum(z for z, _ in group) / len(group) for group in groups]
        for k, group in enumerate(groups):
            for _, cell in group:
                self.level[vertex, cell] = k

    def step(self, vertex: int, left: int, right: int) -> float:
        """Height (m) of the left cell over the right one at a vertex; 0 where they share a level."""
        a, b = self.level[vertex, left], self.level[vertex, right]
        return 0.0 if a == b else self.levels[vertex][a] - self.levels[vertex][b]

    def split_crossings(self) -> None:
        """Put a vertex where the roofs on both sides of an edge cross, or level them at the end that is near."""
        division = self.division
        changed = False
        for u, v in [(u, v) for u, v in division.left if u < v and (v, u) in division.left]:
            left, right = division.left[u, v], division.left[v, u]
            start, end = self.step(u, left, right), self.step(v, left, right)
            if start * end >= 0:
                continue
            changed = True
            t, length = start / (start - end), division.length((u, v))
            if min(t, 1 - t) * length < MIN_EDGE:
                self.tied.setdefault(u if t < 0.5 else v, []).append((left, right))
                continue
            (x1, y1), (x2, y2) = division.xy[u], division.xy[v]
            vertex = division.insert((u, v), x1 + t * (x2 - x1), y1 + t * (y2 - y1))
            self.tied[vertex] = [(left, right)]
        if changed:
            self.refresh()

    def part_corners(self) -> int:
        """Take corners off cells until no four walls meet in a vertical edge; the number of corners taken."""
        taken = 0
        for _ in range(20):
            bad = [v for v in sorted(self.sectors) if self._alternates(v)]
            done = sum(self._take_corner(v) for v in bad)
            if not done:
                break
            taken += done
            self._unite()
            self.refresh()
            self.split_crossings()
        return taken

    def _alternates(self, vertex: int) -> bool:
        ring = [self.level[vertex, cell] for cell in self.sectors[vertex]]
        return any(_changes(ring, k) > 2 for k in range(1, len(self.levels[vertex])))

    def _take_corner(self, vertex: int) -> bool:
        """Give a cell's corner at the vertex to the cell beside it, so that two high or two low cells join."""
        division, ring = self.division, self.sectors[vertex]
        heights = [self.level[vertex, cell] for cell in ring]
        trials = []
        for k, cell in enumerate(ring):
            before, after = heights[k - 1], heights[(k + 1) % len(ring)]
            if cell not in division.cells or ring[k - 1] not in division.cells:
                continue
            if (heights[k] - before) * (heights[k] - after) <= 0:
                continue
            edges = _corner_edges(division, cell, vertex)
            if edges is None or min(division.length(edge) for edge in edges) < 3 * 2e-3:
                continue
            trials.append((heights[k] > min(before, after), abs(heights[k] - before), k, edges))
        if not trials:
            return False
        _, _, k, (into, out) = min(trials)
        cell, beside = ring[k], ring[k - 1]
        p = self._at_distance(into, into[0], vertex)
        q = self._at_distance(out, out[1], vertex)
        parts = division.split(cell, [(p, q)])
        if len(parts) != 2:
            return False
        corner = next(n for n in parts if vertex in division.cells[n][0] and len(division.cells[n][0]) == 3)
        rest = next(n for n in parts if n != corner)
        self.planes[rest] = self.planes.pop(cell)
        self.planes[corner] = self.planes[beside]
        return True

    def _at_distance(self, edge: Edge, far: int, vertex: int) -> int:
        division = self.division
        length = division.length(edge)
        t = min(CORNER, length / 3) / length
        (x, y), (x2, y2) = division.xy[vertex], division.xy[far]
        return division.insert(edge, x + t * (x2 - x), y + t * (y2 - y))

    def _unite(self) -> None:
        """Unite each corner with the cell of the same plane beside it."""
        planes = list({tuple(map(float, plane)): None for plane in self.planes.values()})
        labels = {cell: planes.index(tuple(map(float, plane))) for cell, plane in self.planes.items()}
        labels = self.division.merge(labels)
        self.planes.clear()
        self.planes.update({cell: np.array(planes[label]) for cell, label in labels.items()})


def tied_groups(
    heights: list[tuple[float, S]], shortest: float, tied: Sequence[tuple[S, S]]
) -> list[list[tuple[float, S]]]:
    """Heights of surfaces over one place, grouped from below where they are one.

    Parameters
    ----------
    heights : metres, and whose they are
    shortest : metres, of the edges that meet there
    tied : surfaces that are at one height there, with all between them
    """
    tolerance = max(NO_WALL, min(SAME_HEIGHT, SAME_SLOPE * shortest))
    groups: list[list[tuple[float, S]]] = []
    for item in sorted(heights):
        if groups and item[0] - groups[-1][0][0] <= tolerance:
            groups[-1].append(item)
        else:
            groups.append([item])
    for pair in tied:
        groups = _joined(groups, pair)
    return groups


def _joined(groups: list[list[tuple[float, S]]], pair: tuple[S, S]) -> list[list[tuple[float, S]]]:
    """Groups of heights, lowest first, with those of two surfaces and all between made one."""
    places = [k for k, group in enumerate(groups) for _, surface in group if surface in pair]
    if len(places) < 2 or places[0] == places[-1]:
        return groups
    first, last = places[0], places[-1]
    return [*groups[:first], [item for group in groups[first : last + 1] for item in group], *groups[last + 1 :]]


def _shortest_edges(division: Subdivision) -> dict[int, float]:
    shortest: dict[int, float] = {}
    for u, v in division.left:
        length = division.length((u, v))
        shortest[u], shortest[v] = min(shortest.get(u, length), length), min(shortest.get(v, length), length)
    return shortest


def _changes(levels: list[int], k: int) -> int:
    return sum((levels[i - 1] >= k) != (levels[i] >= k) for i in range(len(levels)))


def _corner_edges(division: Subdivision, cell: int, vertex: int) -> tuple[Edge, Edge] | None:
    """Edges of a cell into and out of a vertex, where the cell's angle there is less than 180°."""
    found = []
    for ring in division.cells[cell]:
        for k, v in enumerate(ring):
            if v == vertex:
                found.append(((ring[k - 1], v), (v, ring[(k + 1) % len(ring)])))
    if len(found) != 1:
        return None
    (into, out) = found[0]
    (x0, y0), (x1, y1), (x2, y2) = division.xy[into[0]], division.xy[vertex], division.xy[out[1]]
    return found[0] if (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1) > 0 else None


def _cells_around(division: Subdivision) -> dict[int, list[int]]:
    """Cells around each vertex, counter-clockwise, the outside included."""
    out: dict[int, list[int]] = {}
    for u, v in division.left:
        out.setdefault(u, []).append(v)
    into: dict[int, list[int]] = {}
    for u, v in division.left:
        if (v, u) not in division.left:
            into.setdefault(v, []).append(u)
    around = {}
    for vertex, ends in out.items():
        x, y = division.xy[vertex]
        rays = [(end, division.left[vertex, end]) for end in ends] + [(end, OUTSIDE) for end in into.get(vertex, [])]
        rays.sort(key=lambda ray: math.atan2(division.xy[ray[0]][1] - y, division.xy[ray[0]][0] - x))
        around[vertex] = [cell for _, cell in rays]
    return around
