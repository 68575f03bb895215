"""The closed hull around columns that stand on the floor or begin at an underside above it.

Every column is what lies between its top and its bottom. Along each edge in plan, the wall is what one of the two columns
has and the other has not; so walls, roofs, undersides and floor close whatever the columns are, as long as no two surfaces
cross along an edge: where they do, the edge gets a vertex.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import Polygon, get_coordinates

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS, Polyhedron, Semantic
from cityflow.reconstruction.partition.subdivision import MIN_EDGE, Subdivision
from cityflow.reconstruction.solids.corner_faces import CornerFace, leaves_line, numbered
from cityflow.reconstruction.solids.corner_heights import tied_groups
from cityflow.reconstruction.solids.ring_tracing import Edge, group_rings, ring_edges, trace_rings
from cityflow.reconstruction.solids.touching_rings import pulled_apart
from cityflow.reconstruction.solids.wall_merging import Corner, Wall, merge_walls
from cityflow.reconstruction.volumetric_parts.hull_columns import Column

Sheet = tuple[int, int]
"""A surface at a place: FLOOR_SHEET, or (BOTTOM or TOP, cell)."""
BOTTOM, TOP = 1, 2
FLOOR_SHEET: Sheet = (0, -1)
STRAIGHT = 5e-4
"""Vertices so little off a line (m) lie on it; rounding."""


class HullLevels:
    """Heights of sheets at the vertices of a subdivision, numbered from below."""

    def __init__(self, division: Subdivision, columns: dict[int, Column], floor: float) -> None:
        self.division, self.columns, self.floor = division, columns, floor
        self.level: dict[tuple[int, Sheet], int] = {}
        self.heights: dict[int, list[float]] = {}
        self.tied: dict[int, list[tuple[Sheet, Sheet]]] = {}
        self._find()
        for _ in range(4):
            if not self._split_crossings():
                break
            self._find()

    def bottom(self, cell: int) -> Sheet:
        return FLOOR_SHEET if self.columns[cell].bottom is None else (BOTTOM, cell)

    def span(self, edge: Edge, cell: int | None) -> tuple[tuple[int, int], tuple[int, int]] | None:
        """Levels of a column's bottom and top at both ends of an edge."""
        if cell is None:
            return None
        low, high = self.bottom(cell), (TOP, cell)
        u, v = edge
        return (self.level[u, low], self.level[v, low]), (self.level[u, high], self.level[v, high])

    def _z(self, vertex: int, sheet: Sheet) -> float:
        if sheet == FLOOR_SHEET:
            return self.floor
        column = self.columns[sheet[1]]
        if sheet[0] == BOTTOM:
            return float(column.bottom if column.bottom is not None else self.floor)
        x, y = self.division.xy[vertex]
        a, b, c = column.top
        return a * x + b * y + c

    def _find(self) -> None:
        self.level.clear()
        self.heights.clear()
        around: dict[int, set[int]] = {}
        shortest: dict[int, float] = {}
        for (u, v), cell in self.division.left.items():
            length = self.division.length((u, v))
            for end in (u, v):
                around.setdefault(end, set()).add(cell)
                shortest[end] = min(shortest.get(end, length), length)
        for vertex in sorted(around):
            self._cluster(vertex, sorted(around[vertex]), shortest[vertex])

    def _cluster(self, vertex: int, cells: list[int], shortest: float) -> None:
        sheets = [FLOOR_SHEET, *((TOP, c) for c in cells), *((BOTTOM, c) for c in cells if self._is_void(c))]
        ordered = [(self._z(vertex, sheet), sheet) for sheet in sheets]
        groups = tied_groups(ordered, shortest, self.tied.get(vertex, []))
        self.heights[vertex] = []
        for k, group in enumerate(groups):
            on_floor = any(sheet == FLOOR_SHEET for _, sheet in group)
            self.heights[vertex].append(self.floor if on_floor else sum(z for z, _ in group) / len(group))
            for _, sheet in group:
                self.level[vertex, sheet] = k

    def _is_void(self, cell: int) -> bool:
        return self.columns[cell].bottom is not None

    def _sheets(self, cell: int) -> list[Sheet]:
        return [(TOP, cell), *([(BOTTOM, cell)] if self._is_void(cell) else [])]

    def _split_crossings(self) -> bool:
        """Put a vertex where sheets of the columns on both sides of an edge cross; True where there was one."""
        division, changed = self.division, False
        for u, v in [(u, v) for u, v in division.left if u < v and (v, u) in division.left]:
            left, right = division.left[u, v], division.left[v, u]
            for one in self._sheets(left):
                for other in self._sheets(right):
                    start = self.level[u, one] - self.level[u, other]
                    end = self.level[v, one] - self.level[v, other]
                    if start * end < 0 and (u, v) in division.left:
                        self._split((u, v), one, other)
                        changed = True
        return changed

    def _split(self, edge: Edge, one: Sheet, other: Sheet) -> None:
        (u, v), division = edge, self.division
        start, end = (self._z(w, one) - self._z(w, other) for w in edge)
        t, length = start / (start - end) if start != end else 0.5, division.length(edge)
        if not MIN_EDGE < t * length < length - MIN_EDGE:
            self.tied.setdefault(u if t < 0.5 else v, []).append((one, other))
            return
        (x1, y1), (x2, y2) = division.xy[u], division.xy[v]
        vertex = division.insert(edge, x1 + t * (x2 - x1), y1 + t * (y2 - y1))
        self.tied[vertex] = [(one, other)]


def build_hull(
    division: Subdivision,
    columns: dict[int, Column],
    floor: float,
    origin: tuple[float, float, float],
    outline: Polygon,
) -> Polyhedron:
    """The solid of all columns.

    Parameters
    ----------
    division : local xy, of the outline; it gets vertices where surfaces cross
    columns : of every cell, local heights
    floor : world height of the ground face, metres
    origin : world coordinates of the local origin
    outline : world; its vertices are taken over bit for bit
    """
    fixed = np.concatenate([get_coordinates(ring)[:-1] for ring in (outline.exterior, *outline.interiors)])
    shifts = pulled_apart(division)
    for vertex, place in shifts.items():
        division.xy[vertex] = place
    levels = HullLevels(division, columns, floor - origin[2])
    world = np.round(np.array(division.xy) + np.asarray(origin[:2]), VERTEX_DECIMALS)
    kept = [v for v in range(division.fixed) if v not in shifts]
    world[kept] = fixed[kept]
    return _Hull(levels, world, origin[2], floor).polyhedron()


@dataclass(frozen=True, slots=True)
class _Hull:
    levels: HullLevels
    world: FloatArray
    z0: float
    floor: float

    def polyhedron(self) -> Polyhedron:
        faces: list[CornerFace] = []
        columns = self.levels.columns
        cells = sorted(columns)
        for members in _alike(cells, [(columns[c].surface, columns[c].top) for c in cells]):
            surface = columns[members[0]].surface
            faces += [CornerFace(part, Semantic.ROOF, surface) for part in self._level_parts(members, TOP)]
        hollow = [c for c in cells if columns[c].bottom is not None]
        for members in _alike(hollow, [columns[c].bottom for c in hollow]):
            faces += [CornerFace(_turned(part), Semantic.OUTER_CEILING) for part in self._level_parts(members, BOTTOM)]
        faces += [CornerFace([ring], Semantic.WALL) for ring in merge_walls(self._walls(), self.world)]
        grounded = [c for c in cells if columns[c].bottom is None]
        faces += [CornerFace(_turned(part), Semantic.GROUND) for part in self._level_parts(grounded, 0)]
        return numbered(faces, self._position, self._is_needed)

    def _level_parts(self, cells: list[int], kind: int) -> list[list[list[Corner]]]:
        """Connected parts of cells on one plane, as rings of corners, the cells on the left."""
        division, level = self.levels.division, self.levels.level
        members = set(cells)
        border = []
        for cell in cells:
            for ring in division.cells[cell]:
                for u, v in ring_edges(ring):
                    other = division.left.get((v, u))
                    if other not in members or not self._same((u, v), cell, other, kind):
                        border.append((u, v))
        sheet_of = {}
        for cell in cells:
            for ring in division.cells[cell]:
                sheet_of.update(dict.fromkeys(ring, FLOOR_SHEET if kind == 0 else (kind, cell)))
        parts = group_rings(trace_rings(border, division.xy), division.xy)
        return [[[(v, level[v, sheet_of[v]]) for v in ring] for ring in part] for part in parts]

    def _same(self, edge: Edge, cell: int, other: int, kind: int) -> bool:
        level = self.levels.level
        return kind == 0 or all(level[v, (kind, cell)] == level[v, (kind, other)] for v in edge)

    def _walls(self) -> list[Wall]:
        division, walls = self.levels.division, []
        on_outline = division.outline_edges()
        for edge in sorted(division.left):
            own = self.levels.span(edge, division.left[edge])
            other = self.levels.span(edge, division.left.get((edge[1], edge[0])))
            assert own is not None
            for low, high in _beyond(own, other):
                if low != high:
                    walls.append(Wall(_wall_ring(edge, low, high), edge, on_outline.get(edge, -1)))
        return walls

    def _position(self, corner: Corner) -> tuple[float, float, float]:
        vertex, level = corner
        on_floor = self.levels.level.get((vertex, FLOOR_SHEET)) == level
        z = self.floor if on_floor else round(self.levels.heights[vertex][level] + self.z0, VERTEX_DECIMALS)
        return float(self.world[vertex, 0]), float(self.world[vertex, 1]), z

    def _is_needed(self, corner: Corner, around: set[Corner]) -> bool:
        if corner[0] < self.levels.division.fixed or len(around) != 2:
            return True
        return leaves_line(self._position(corner), [self._position(c) for c in sorted(around)], STRAIGHT)


def _alike(cells: Sequence[int], keys: Sequence[object]) -> list[list[int]]:
    """Cells of the same key, in the order in which keys first come."""
    found: dict[object, list[int]] = {}
    for cell, key in zip(cells, keys, strict=True):
        found.setdefault(key, []).append(cell)
    return list(found.values())


def _turned(part: Sequence[Sequence[Corner]]) -> list[list[Corner]]:
    return [list(reversed(ring)) for ring in part]


Pair = tuple[int, int]


def _beyond(own: tuple[Pair, Pair], other: tuple[Pair, Pair] | None) -> list[tuple[Pair, Pair]]:
    """What a column has along an edge and the one beside it has not: spans between levels at both ends."""
    low, high = own
    if other is None:
        return [own]
    below, above = other
    if sum(below) >= sum(high) or sum(above) <= sum(low):
        return [own]
    spans = []
    if sum(below) > sum(low):
        spans.append((low, below))
    if sum(above) < sum(high):
        spans.append((above, high))
    return spans


def _wall_ring(edge: Edge, low: Pair, high: Pair) -> tuple[Corner, ...]:
    u, v = edge
    up = [(v, k) for k in range(low[1], high[1] + 1)]
    down = [(u, k) for k in range(high[0], low[0] - 1, -1)]
    return (*up, *down)
