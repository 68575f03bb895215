"""A planar subdivision that can be cut by lines, merged by labels and cleaned, always without cracks.

Cells share vertices by index. Whenever a vertex is put on an edge, the cells on both sides get it, so that the
subdivision stays conforming whatever happens in floating point.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from shapely import Polygon

from cityflow.reconstruction.partition.cut_line import ON_LINE, CutLine, overlap_along
from cityflow.reconstruction.solids.ring_tracing import (
    Edge,
    Ring,
    group_rings,
    halves,
    inside_rings,
    ring_area,
    ring_edges,
    trace_rings,
)

MIN_EDGE = 0.01
"""A line that crosses an edge nearer to one of its ends than this (m) goes through that end."""


class Subdivision:
    """Cells of a polygon: `cells[i]` is exterior ring and holes, `left[u, v]` the cell on the left of an edge."""

    def __init__(self) -> None:
        self.xy: list[tuple[float, float]] = []
        self.cells: dict[int, list[Ring]] = {}
        self.left: dict[Edge, int] = {}
        self.fixed = 0
        self._next = 0

    @classmethod
    def of_polygon(cls, outline: Polygon) -> Subdivision:
        """One cell; the first `fixed` vertices are those of the outline, ring by ring in its own order."""
        division = cls()
        rings: list[Ring] = []
        for number, ring in enumerate((outline.exterior, *outline.interiors)):
            first = len(division.xy)
            division.xy.extend((float(x), float(y)) for x, y in np.asarray(ring.coords)[:-1, :2])
            indices = list(range(first, len(division.xy)))
            wrong_way = (ring_area(indices, division.xy) > 0) == (number > 0)
            rings.append(indices[::-1] if wrong_way else indices)
        division.fixed = len(division.xy)
        division.add(rings)
        return division

    def add(self, rings: list[Ring]) -> int:
        """A new cell; returns its number."""
        number = self._next
        self._next += 1
        self.cells[number] = rings
        for ring in rings:
            self.left.update(dict.fromkeys(ring_edges(ring), number))
        return number

    def remove(self, number: int) -> None:
        for ring in self.cells.pop(number):
            for edge in ring_edges(ring):
                self.left.pop(edge, None)

    def area(self, number: int) -> float:
        return sum(ring_area(ring, self.xy) for ring in self.cells[number])

    def polygon(self, number: int) -> Polygon:
        shell, *holes = ([self.xy[v] for v in ring] for ring in self.cells[number])
        return Polygon(shell, holes)

    def length(self, edge: Edge) -> float:
        (x1, y1), (x2, y2) = self.xy[edge[0]], self.xy[edge[1]]
        return math.hypot(x2 - x1, y2 - y1)

    def insert(self, edge: Edge, x: float, y: float) -> int:
        """A new vertex on an edge, in the cells on both sides."""
        vertex = len(self.xy)
        self.xy.append((x, y))
        for u, v in (edge, edge[::-1]):
            cell = self.left.pop((u, v), None)
            if cell is None:
                continue
            self.left[u, vertex] = self.left[vertex, v] = cell
            for ring in self.cells[cell]:
                place = _place_of_edge(ring, u, v)
                if place is not None:
                    ring.insert(place + 1, vertex)
                    break
        return vertex

    def split(self, number: int, chords: Iterable[Edge]) -> list[int]:
        """Cut a cell along chords between vertices of its rings.

        Returns the new cells' numbers; the cell itself, unchanged, where the chords do not separate anything.
        """
        chords, rings = list(chords), self.cells[number]
        if len(rings) == len(chords) == 1 and (pair := halves(rings[0], chords[0], self.xy)):
            self.remove(number)
            return [self.add([half]) for half in pair]
        edges = [edge for ring in rings for edge in ring_edges(ring)]
        both = [direction for chord in chords for direction in (chord, chord[::-1])]
        rings = trace_rings([*edges, *both], self.xy)
        parts = group_rings(rings, self.xy)
        traced = sum(len(ring) for part in parts for ring in part)
        if len(parts) < 2 or traced != len(edges) + len(both) or any(_has_slit(part) for part in parts):
            return [number]
        self.remove(number)
        return [self.add(part) for part in parts]

    def cut(self, number: int, line: CutLine) -> list[int]:
        """Cut a cell along the line where the stretch that matters crosses it; numbers of the parts."""
        crossings = self._crossings(number, line)
        if len(crossings) < 2:
            return [number]
        chosen = self._chords(number, line, crossings)
        if not chosen:
            return [number]
        vertices = [v if isinstance(v, int) else -1 for _, v in crossings]
        chords: list[Edge] = []
        for i in chosen:
            for end in (i, i + 1):
                if vertices[end] < 0:
                    edge = crossings[end][1]
                    assert not isinstance(edge, int)
                    vertices[end] = self._insert_crossing(edge, line)
            chords.append((vertices[i], vertices[i + 1]))
        return self.split(number, chords)

    def _insert_crossing(self, edge: Edge, line: CutLine) -> int:
        (x1, y1), (x2, y2) = self.xy[edge[0]], self.xy[edge[1]]
        s1, s2 = line.side(x1, y1), line.side(x2, y2)
        t = s1 / (s1 - s2)
        return self.insert(edge, x1 + t * (x2 - x1), y1 + t * (y2 - y1))

    def _crossings(self, number: int, line: CutLine) -> list[tuple[float, int | Edge]]:
        """Where the line meets the cell's rings: position along the line, and the vertex or the edge crossed."""
        vertices: set[int] = set()
        found: list[tuple[float, int | Edge]] = []
        xy, nx, ny, offset = self.xy, line.nx, line.ny, line.offset
        sides_of = [[nx * xy[v][0] + ny * xy[v][1] - offset for v in ring] for ring in self.cells[number]]
        if min(map(min, sides_of)) >= -ON_LINE or max(map(max, sides_of)) <= ON_LINE:
            return []
        for ring, sides in zip(self.cells[number], sides_of, strict=True):
            for k, s2 in enumerate(sides):
                u, v, s1 = ring[k - 1], ring[k], sides[k - 1]
                if abs(s2) <= ON_LINE:
                    vertices.add(v)
                if s1 * s2 >= 0 or min(abs(s1), abs(s2)) <= ON_LINE:
                    continue
                t = s1 / (s1 - s2)
                near, length = (u if t < 0.5 else v), self.length((u, v))
                if min(t, 1 - t) * length < MIN_EDGE:
                    vertices.add(near)
                else:
                    t1, t2 = line.along(*self.xy[u]), line.along(*self.xy[v])
                    found.append((t1 + t * (t2 - t1), (u, v)))
        found += [(line.along(*self.xy[v]), v) for v in vertices]
        return sorted(found, key=lambda item: (item[0], str(item[1])))

    def _chords(self, number: int, line: CutLine, crossings: list[tuple[float, int | Edge]]) -> list[int]:
        """Indices i where the line between crossings i and i + 1 runs inside the cell and matters."""
        rings = self.cells[number]
        inner = []
        for i in range(len(crossings) - 1):
            (t1, a), (t2, b) = crossings[i], crossings[i + 1]
            if isinstance(a, int) and isinstance(b, int) and (self._borders(number, a, b) or a == b):
                continue
            t = (t1 + t2) / 2
            if len(crossings) == 2 or inside_rings(*line.at(t), rings, self.xy):
                inner.append(i)
        matter = [i for i in inner if overlap_along(crossings[i][0], crossings[i + 1][0], line)]
        # Only all chords together are sure to separate a cell that has holes.
        return inner if matter and len(rings) > 1 else matter

    def _borders(self, number: int, a: int, b: int) -> bool:
        return self.left.get((a, b)) == number or self.left.get((b, a)) == number

    def merge(self, labels: Mapping[int, int]) -> dict[int, int]:
        """Unite neighbouring cells of the same label; labels of the cells that result."""
        for group in self._groups(labels):
            if len(group) == 1:
                continue
            members = set(group)
            edges = [e for c in group for ring in self.cells[c] for e in ring_edges(ring)]
            border = [(u, v) for u, v in edges if self.left.get((v, u), -1) not in members]
            for c in group:
                self.remove(c)
            label = labels[group[0]]
            labels = {c: other for c, other in labels.items() if c not in members}
            for part in group_rings(trace_rings(border, self.xy), self.xy):
                labels[self.add(part)] = label
        return dict(labels)

    def _groups(self, labels: Mapping[int, int]) -> list[list[int]]:
        seen: set[int] = set()
        groups = []
        for first in self.cells:
            if first in seen:
                continue
            group, queue = [], [first]
            seen.add(first)
            while queue:
                cell = queue.pop()
                group.append(cell)
                for other in self.neighbours(cell):
                    if other not in seen and labels[other] == labels[first]:
                        seen.add(other)
                        queue.append(other)
            groups.append(sorted(group))
        return groups

    def neighbours(self, number: int) -> list[int]:
        """Cells across the edges of a cell, each once, in the order of its rings."""
        across = (self.left.get((v, u)) for ring in self.cells[number] for u, v in ring_edges(ring))
        return list(dict.fromkeys(c for c in across if c is not None and c != number))

    def outline_edges(self) -> dict[Edge, int]:
        """Number of the outline's edge, by its first vertex, on which each border edge lies."""
        following = {u: v for u, v in sorted(self.left) if (v, u) not in self.left}
        found: dict[Edge, int] = {}
        for first in range(self.fixed):
            u = first
            while u in following and (u, following[u]) not in found:
                found[u, following[u]] = first
                u = following[u]
                if u < self.fixed:
                    break
        return found

    def dissolve(self, tolerance: float = ON_LINE) -> None:
        """Remove vertices that are not the outline's, and where one straight edge merely goes on."""
        ends: dict[int, set[int]] = {}
        for u, v in self.left:
            ends.setdefault(u, set()).add(v)
            ends.setdefault(v, set()).add(u)
        for vertex in sorted(ends):
            if vertex < self.fixed or len(ends[vertex]) != 2:
                continue
            a, b = sorted(ends[vertex])
            if (a, b) in self.left or (b, a) in self.left or self._height(vertex, a, b) > tolerance:
                continue
            self._drop(vertex, a, b)
            ends[a] = (ends[a] - {vertex}) | {b}
            ends[b] = (ends[b] - {vertex}) | {a}

    def _height(self, vertex: int, a: int, b: int) -> float:
        """Distance (m) of a vertex from the line a–b."""
        (x, y), (x1, y1), (x2, y2) = self.xy[vertex], self.xy[a], self.xy[b]
        return abs((x - x1) * (y2 - y1) - (y - y1) * (x2 - x1)) / math.hypot(x2 - x1, y2 - y1)

    def _drop(self, vertex: int, a: int, b: int) -> None:
        for u, v in ((a, b), (b, a)):
            cell = self.left.pop((u, vertex), None)
            if cell is None:
                continue
            del self.left[vertex, v]
            self.left[u, v] = cell
            for ring in self.cells[cell]:
                place = _place_of_edge(ring, u, vertex)
                if place is not None:
                    del ring[(place + 1) % len(ring)]
                    break


def _place_of_edge(ring: Ring, u: int, v: int) -> int | None:
    k = ring.index(u) if u in ring else -1
    return k if k >= 0 and ring[(k + 1) % len(ring)] == v else None


def _has_slit(rings: list[Ring]) -> bool:
    edges = {edge for ring in rings for edge in ring_edges(ring)}
    return any((v, u) in edges for u, v in edges)
