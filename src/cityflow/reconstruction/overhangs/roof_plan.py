"""A roof in plan: cells that share vertices, each with the heights of its upper side and, beyond the walls, of its lower one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS, Face, Polyhedron, Semantic
from cityflow.reconstruction.solids.ring_tracing import Edge, Ring, ring_edges

ONE_M = 1e-3
"""Vertices nearer than this are one, and a vertex this near to an edge lies on it."""


class UnfitRoof(Exception):
    """A roof that cannot be extended, and why; never leaves the package."""


@dataclass
class PlanCell:
    """A polygon of the plan.

    Attributes
    ----------
    rings : exterior counter-clockwise, holes clockwise; plan vertices
    face : number of the roof face that it is, or that it continues
    tops : vertex → world height of the upper side, metres
    inside : it stands over the walls' outline, so that it reaches down to the floor
    """

    rings: list[Ring]
    face: int
    tops: dict[int, float] = field(default_factory=dict)
    inside: bool = True

    def edges(self) -> list[Edge]:
        return [edge for ring in self.rings for edge in ring_edges(ring)]


class RoofPlan:
    """The cells of a solid's roof over shared plan vertices.

    Attributes
    ----------
    xy : world positions of the plan vertices
    cells : those over the outline first
    faces : roof faces of the solid;  planes : (F, 3) a, b, c of z = a·x + b·y + c, local to `origin`
    floor : world height of the ground face, metres
    corners : plan vertices of the ground face's rings
    """

    def __init__(self, solid: Polyhedron) -> None:
        self.xy: list[tuple[float, float]] = []
        self._index: dict[tuple[float, float], int] = {}
        self.cells: list[PlanCell] = []
        self.faces: tuple[Face, ...] = solid.of_semantic(Semantic.ROOF)
        ground = solid.of_semantic(Semantic.GROUND)
        if not ground or not self.faces:
            raise UnfitRoof("the solid has no ground or no roof")
        self.floor = float(solid.ring(ground[0].rings[0])[0, 2])
        self.origin = np.floor(solid.vertices.min(axis=0))
        rings = [[self._vertex(solid, v) for v in ring] for face in ground for ring in face.rings]
        self.corners = frozenset(v for ring in rings for v in ring)
        self.ground_area = float(
            sum(Polygon(solid.ring(f.rings[0]), [solid.ring(r) for r in f.rings[1:]]).area for f in ground)
        )
        for number, face in enumerate(self.faces):
            self.cells.append(self._cell(solid, face, number))
        self.planes = np.array([self._plane(cell) for cell in self.cells])
        self.tie()
        self._check()

    def _vertex(self, solid: Polyhedron, v: int) -> int:
        return self.vertex(float(solid.vertices[v, 0]), float(solid.vertices[v, 1]))

    def vertex(self, x: float, y: float) -> int:
        """Number of the plan vertex at exactly this place."""
        if (x, y) not in self._index:
            self._index[x, y] = len(self.xy)
            self.xy.append((x, y))
        return self._index[x, y]

    def local(self) -> FloatArray:
        """(V, 2) positions from `origin`."""
        return np.asarray(self.xy, np.float64).reshape(-1, 2) - self.origin[:2]

    def _cell(self, solid: Polyhedron, face: Face, number: int) -> PlanCell:
        rings: list[Ring] = []
        tops: dict[int, float] = {}
        for ring in face.rings:
            plan = [self._vertex(solid, v) for v in ring]
            if len(set(plan)) < len(plan):
                raise UnfitRoof("a roof face is vertical")
            tops |= {p: float(solid.vertices[v, 2]) for p, v in zip(plan, ring, strict=True)}
            rings.append(plan)
        return PlanCell(rings, number, tops)

    def _plane(self, cell: PlanCell) -> FloatArray:
        used = sorted(cell.tops)
        points = np.column_stack([self.local()[used], [cell.tops[v] - self.origin[2] for v in used]])
        middle = points.mean(axis=0)
        near = points - middle
        a, b = np.linalg.lstsq(near[:, :2], near[:, 2], rcond=None)[0]
        return np.array([a, b, middle[2] - a * middle[0] - b * middle[1]])

    def height(self, face: int, vertex: int) -> float:
        """World height of a face's plane over a plan vertex."""
        x, y = self.xy[vertex]
        a, b, c = self.planes[face]
        return float(a * (x - self.origin[0]) + b * (y - self.origin[1]) + c + self.origin[2])

    def add_outside(self, polygons: Iterable[Polygon]) -> list[PlanCell]:
        """New cells beyond the walls, from polygons local to `origin`; they have no face and no heights yet."""
        added = []
        for polygon in map(orient, polygons):
            rings = [self._snapped(shapely.get_coordinates(r)[:-1]) for r in (polygon.exterior, *polygon.interiors)]
            kept = [r for r in rings if len(r) > 2]
            if kept and len(rings[0]) > 2:
                added.append(PlanCell(kept, -1, inside=False))
        self.cells += added
        self.tie()
        return added

    def _snapped(self, xy: FloatArray) -> Ring:
        """Numbers of the nearest vertices, new ones where none is near, none twice in a row."""
        ring: Ring = []
        for x, y in xy:
            fixed = self.local()
            apart = np.hypot(fixed[:, 0] - x, fixed[:, 1] - y)
            nearest = int(np.argmin(apart))
            if apart[nearest] <= ONE_M:
                vertex = nearest
            else:
                vertex = self.vertex(
                    round(float(x + self.origin[0]), VERTEX_DECIMALS), round(float(y + self.origin[1]), VERTEX_DECIMALS)
                )
            if not ring or ring[-1] != vertex:
                ring.append(vertex)
        while len(ring) > 1 and ring[0] == ring[-1]:
            ring.pop()
        return ring

    def tie(self) -> None:
        """Put every vertex that lies on a cell's edge into that cell, so that neighbours have the same edges."""
        used = sorted({v for cell in self.cells for ring in cell.rings for v in ring})
        local = self.local()
        for cell in self.cells:
            cell.rings = [self._tied(cell, ring, used, local) for ring in cell.rings]

    def _tied(self, cell: PlanCell, ring: Ring, used: Sequence[int], local: FloatArray) -> Ring:
        tied: Ring = []
        others = local[used]
        for u, v in ring_edges(ring):
            tied.append(u)
            start, way = local[u], local[v] - local[u]
            length = float(np.hypot(*way))
            along = (others - start) @ way / length
            off = np.abs((others - start) @ np.array([way[1], -way[0]])) / length
            on = np.flatnonzero((off <= ONE_M) & (along > ONE_M) & (along < length - ONE_M))
            for k in on[np.argsort(along[on], kind="stable")]:
                vertex, share = used[int(k)], float(along[k]) / length
                tied.append(vertex)
                if u in cell.tops and v in cell.tops:
                    cell.tops.setdefault(vertex, cell.tops[u] + share * (cell.tops[v] - cell.tops[u]))
        return tied

    def left(self) -> dict[Edge, int]:
        """The cell on the left of each directed edge.

        Raises
        ------
        UnfitRoof
            Cells overlap.
        """
        left: dict[Edge, int] = {}
        for number, cell in enumerate(self.cells):
            for edge in cell.edges():
                if edge in left:
                    raise UnfitRoof("roof polygons overlap")
                left[edge] = number
        return left

    def border(self) -> dict[Edge, int]:
        """Edges of the outline, the building on their left, with the cell that stands on each."""
        edges = {e: n for n, cell in enumerate(self.cells) if cell.inside for e in cell.edges()}
        return {(u, v): n for (u, v), n in edges.items() if (v, u) not in edges}

    def _check(self) -> None:
        self.left()
        local = self.local()
        area = sum(Polygon(local[c.rings[0]], [local[r] for r in c.rings[1:]]).area for c in self.cells)
        border = self.border()
        starts = [u for u, _ in border]
        if abs(area - self.ground_area) > 1e-3 * max(self.ground_area, 1.0) or len(set(starts)) < len(starts):
            raise UnfitRoof("the roof does not cover the outline once")
        if not self.corners <= set(starts):
            raise UnfitRoof("the roof does not end at the outline")
