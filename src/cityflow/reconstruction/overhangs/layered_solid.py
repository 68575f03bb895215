"""A closed solid from plan cells that each reach from a lower to an upper height: floor to roof, or slab beyond the walls."""

from __future__ import annotations

import numpy as np

from cityflow.core.building import VERTEX_DECIMALS, Polyhedron, Semantic
from cityflow.reconstruction.overhangs.roof_plan import RoofPlan, UnfitRoof
from cityflow.reconstruction.solids.corner_faces import CornerFace, Place, leaves_line, numbered
from cityflow.reconstruction.solids.ring_tracing import Edge, group_rings, trace_rings
from cityflow.reconstruction.solids.wall_merging import Corner, Wall, merge_walls

TIED_M, TIED_OUTSIDE_M = 0.004, 0.015
"""Heights over one vertex that differ by no more than this are one; beyond the walls two planes miss each other by what was settled at the wall."""

STRAIGHT_M = 5e-4
"""A corner of two faces only that lies this near to the line between its neighbours is left out."""


class LayeredSolid:
    """The faces between cells that reach from one level to another over every plan vertex."""

    def __init__(self, plan: RoofPlan, slab_m: float) -> None:
        self.plan, self.slab_m = plan, slab_m
        self.left = plan.left()
        self.top: dict[tuple[int, int], int] = {}
        self.bottom: dict[tuple[int, int], int] = {}
        self.levels: dict[int, list[float]] = {}
        self.floor_level: dict[int, int] = {}
        self._find_levels()

    def polyhedron(self) -> Polyhedron:
        """The solid; not yet looked at for validity.

        Raises
        ------
        UnfitRoof
            The upper or lower sides of two cells cross along an edge.
        """
        cells = frozenset(range(len(self.plan.cells)))
        return self._numbered([*self._faces(cells), *self._ground()])

    def beyond(self) -> Polyhedron:
        """Of the solid only the cells beyond the walls: roofs in the planes of theirs, rims, undersides; open where the walls are."""
        return self._numbered(self._faces(frozenset(k for k, c in enumerate(self.plan.cells) if not c.inside)))

    def _faces(self, cells: frozenset[int]) -> list[CornerFace]:
        walls = merge_walls(self._walls(cells), np.asarray(self.plan.xy, np.float64))
        rims = [CornerFace((ring,), Semantic.WALL) for ring in walls]
        return [*self._roofs(cells), *rims, *self._undersides(cells)]

    def _find_levels(self) -> None:
        heights: dict[int, list[tuple[float, int, bool]]] = {}
        corners = {v for edge in self.plan.border() for v in edge}
        outer = set(range(len(self.plan.xy))) - {
            v for c in self.plan.cells if c.inside for ring in c.rings for v in ring
        }
        for number, cell in enumerate(self.plan.cells):
            for vertex in dict.fromkeys(v for ring in cell.rings for v in ring):
                top = cell.tops[vertex]
                low = self.plan.floor if cell.inside else top - self.slab_m
                heights.setdefault(vertex, []).extend([(top, number, True), (low, number, False)])
        for vertex, found in heights.items():
            found.sort()
            tied = TIED_OUTSIDE_M if vertex in outer else TIED_M
            levels: list[list[float]] = []
            for z, number, upper in found:
                if not levels or z - levels[-1][0] > tied:
                    levels.append([])
                levels[-1].append(z)
                (self.top if upper else self.bottom)[vertex, number] = len(levels) - 1
            self.levels[vertex] = [sum(group) / len(group) for group in levels]
            if vertex in corners:
                self.floor_level[vertex] = 0
                self.levels[vertex][0] = self.plan.floor

    def _roofs(self, cells: frozenset[int]) -> list[CornerFace]:
        faces = []
        for number, face in enumerate(self.plan.faces):
            own = [k for k, cell in enumerate(self.plan.cells) if k in cells and cell.face == number]
            for rings in self._united(own, self.top):
                faces.append(CornerFace(rings, Semantic.ROOF, face.plane))
        return faces

    def _undersides(self, cells: frozenset[int]) -> list[CornerFace]:
        faces = []
        for number in range(len(self.plan.faces)):
            own = [k for k, c in enumerate(self.plan.cells) if k in cells and c.face == number and not c.inside]
            for rings in self._united(own, self.bottom):
                turned = tuple(ring[::-1] for ring in rings)
                faces.append(CornerFace(turned, Semantic.OUTER_CEILING))
        return faces

    def _united(self, cells: list[int], level: dict[tuple[int, int], int]) -> list[tuple[tuple[Corner, ...], ...]]:
        """Rings of corners around cells of one plane, without the edges along which they go on level."""
        own = set(cells)
        border: list[Edge] = []
        for k in cells:
            for u, v in self.plan.cells[k].edges():
                other = self.left.get((v, u), -1)
                same = other in own and all(level[w, k] == level[w, other] for w in (u, v))
                if not same:
                    border.append((u, v))
        at = {(v, level[v, k]) for k in cells for ring in self.plan.cells[k].rings for v in ring}
        height = dict(sorted(at))
        if len(height) < len(at):
            return [rings for k in cells for rings in self._single(k, level)]
        parts = group_rings(trace_rings(border, self.plan.xy), self.plan.xy)
        return [tuple(tuple((v, height[v]) for v in ring) for ring in part) for part in parts]

    def _single(self, k: int, level: dict[tuple[int, int], int]) -> list[tuple[tuple[Corner, ...], ...]]:
        return [tuple(tuple((v, level[v, k]) for v in ring) for ring in self.plan.cells[k].rings)]

    def _walls(self, cells: frozenset[int]) -> list[Wall]:
        stands_on = self._outline_edges()
        walls = []
        for (u, v), cell in sorted((edge, cell) for edge, cell in self.left.items() if cell in cells):
            other = self.left.get((v, u), -1)
            number = stands_on.get((u, v), -1)
            for low, high in self._free(u, v, cell, other):
                up = [(v, k) for k in range(low[1], high[1] + 1)]
                down = [(u, k) for k in range(high[0], low[0] - 1, -1)]
                if len(up) + len(down) > 2:
                    walls.append(Wall((*up, *down), (u, v), number))
        return walls

    def _free(self, u: int, v: int, cell: int, other: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
        """Lower and upper levels, at both ends, of the parts of a cell's side that no neighbour covers."""
        top = self.top[u, cell], self.top[v, cell]
        bottom = self.bottom[u, cell], self.bottom[v, cell]
        if other < 0:
            return [(bottom, top)]
        next_top = self.top[u, other], self.top[v, other]
        next_bottom = self.bottom[u, other], self.bottom[v, other]
        for mine in (top, bottom):
            for its in (next_top, next_bottom):
                if (mine[0] - its[0]) * (mine[1] - its[1]) < 0:
                    raise UnfitRoof("two roofs cross along an edge")
        above = max(bottom[0], next_top[0]), max(bottom[1], next_top[1])
        below = min(top[0], next_bottom[0]), min(top[1], next_bottom[1])
        free = []
        if top[0] >= above[0] and top[1] >= above[1]:
            free.append((above, top))
        if below[0] >= bottom[0] and below[1] >= bottom[1]:
            free.append((bottom, below))
        return free

    def _outline_edges(self) -> dict[Edge, int]:
        """Number of the outline edge, by its first vertex, on which each border edge lies."""
        after = dict(self.plan.border().keys())
        found: dict[Edge, int] = {}
        for first in sorted(self.plan.corners):
            u = first
            while (u, after[u]) not in found:
                found[u, after[u]] = first
                u = after[u]
                if u in self.plan.corners:
                    break
        return found

    def _ground(self) -> list[CornerFace]:
        xy = self.plan.xy
        parts = group_rings(trace_rings(list(self.plan.border()), xy), xy)
        return [
            CornerFace(tuple(tuple((v, 0) for v in reversed(ring)) for ring in part), Semantic.GROUND) for part in parts
        ]

    def _numbered(self, faces: list[CornerFace]) -> Polyhedron:
        made = numbered(faces, self._position, self._is_needed)
        return Polyhedron(made.vertices, tuple(face for face in made.faces if len(face.rings[0]) > 2))

    def _position(self, corner: Corner) -> Place:
        vertex, level = corner
        on_floor = self.floor_level.get(vertex) == level
        z = self.plan.floor if on_floor else round(self.levels[vertex][level], VERTEX_DECIMALS)
        x, y = self.plan.xy[vertex]
        return float(x), float(y), z

    def _is_needed(self, corner: Corner, around: set[Corner]) -> bool:
        if (corner[0] in self.plan.corners and corner[1] == 0) or len(around) != 2:
            return True
        return leaves_line(self._position(corner), [self._position(c) for c in sorted(around)], STRAIGHT_M)
