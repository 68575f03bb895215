"""From topology to geometry: plane intersections limited by nodes, or the inconsistency that was found.

Frommholz 2017, section 3. A node inside is where the lines of its edges meet, one at the contour where the line of its edge
meets a wall. Nodes that the cells put in the wrong order are put right, nodes nearer to each other than they can be told apart
become one, and then the planes around it are made to pass through it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.monolithic_parts.crossing_lines import Line, crossing_line, meeting_point, plan_line
from cityflow.reconstruction.monolithic_parts.skeleton_values import (
    LEVEL_M,
    NODE_CELLS,
    REACH_CELLS,
    SAME_NODE_M,
    SPREAD_M,
    TIE_M,
    Frame,
    Inconsistency,
    Skeleton,
)
from cityflow.reconstruction.monolithic_parts.tied_planes import through_ties
from cityflow.reconstruction.monolithic_parts.topology import TopologicalEdge, Topology, contracted, flipped

MOST_CHANGES = 100
"""Bounds time; set by hand."""


def build_skeleton(topology: Topology, planes: FloatArray, frame: Frame) -> Skeleton:
    """The skeleton of a roof.

    Raises
    ------
    Inconsistency
    """
    if any(min(pair) >= 0 for pair in topology.loops):
        raise Inconsistency("an edge without ends: one surface lies inside another")
    skeleton = Skeleton(topology, planes)
    builder = _Builder(skeleton, frame)
    for edge in topology.edges:
        if edge.inner():
            builder.explain(edge)
    builder.place_all()
    builder.merge_near()
    builder.reorder()
    builder.merge_near()
    builder.tie()
    return skeleton


@dataclass(slots=True)
class _Builder:
    skeleton: Skeleton
    frame: Frame

    def plane(self, surface: int) -> FloatArray:
        return np.asarray(self.skeleton.planes[self.skeleton.topology.plane_of[surface]])

    def line(self, edge: TopologicalEdge) -> Line | None:
        return crossing_line(self.plane(edge.left), self.plane(edge.right))

    def explain(self, edge: TopologicalEdge) -> None:
        """Is the chain where the planes of its sides meet?"""
        p, q = self.plane(edge.left), self.plane(edge.right)
        xy = self.frame.grid.corners(edge.chain)
        step = np.abs(xy @ (p[:2] - q[:2]) + p[2] - q[2])
        plan = plan_line(p, q)
        if plan is not None:
            away = np.abs(xy @ plan[0] - plan[1])
            allowed = REACH_CELLS * self.frame.grid.cell
            near = (away <= allowed) | (step <= max(LEVEL_M, 2 * self.frame.sigma))
            if np.mean(near) >= 0.75:
                return
        raise Inconsistency(f"a step of {np.median(step):.2f} m without an intersection of planes")

    def place_all(self) -> None:
        for node in sorted(self.skeleton.topology.nodes):
            self.set_place(node)

    def set_place(self, node: int) -> None:
        """Position of a node from the lines of its edges."""
        topology, s = self.skeleton.topology, self.skeleton
        for known in (s.place, s.wall, s.vertex):
            known.pop(node, None)
        inner = topology.inner_edges(node)
        if not inner:
            return
        if topology.on_contour(node):
            self._on_wall(node, inner)
            return
        lines = [line for edge in inner if (line := self.line(edge)) is not None]
        met = meeting_point(lines)
        if met is None:
            raise Inconsistency("parallel edges in one node")
        if met[1] > SPREAD_M:
            raise Inconsistency(f"the lines of a node are {met[1]:.2f} m apart")
        s.place[node] = met[0][:2]
        self._check_distance(node)

    def _check_distance(self, node: int) -> None:
        rough = self.frame.grid.corners(np.array([self.skeleton.topology.nodes[node]], np.float64))[0]
        away = float(np.hypot(*(self.skeleton.place[node] - rough)))
        if away > NODE_CELLS * self.frame.grid.cell:
            raise Inconsistency(f"a node is {away:.1f} m from its cells")

    def _on_wall(self, node: int, inner: list[TopologicalEdge]) -> None:
        """Where the edge's line meets the wall that the contour's scan saw it on, or the corner."""
        s, contour = self.skeleton, self.frame.contour
        rough = self.frame.grid.corners(np.array([s.topology.nodes[node]], np.float64))[0]
        best: tuple[float, int, FloatArray] | None = None
        for edge in inner:
            plan = plan_line(self.plane(edge.left), self.plane(edge.right))
            if plan is None:
                continue
            walls, xy = contour.crossings(*plan)
            preferred = self._scanned_walls(edge, rough)
            away = np.hypot(*(xy - rough).T) + np.where(np.isin(walls, preferred), 0.0, self.frame.grid.cell)
            if len(away) and (best is None or away.min() < best[0]):
                k = int(np.argmin(away))
                best = float(away[k]), int(walls[k]), xy[k]
        if best is None:
            raise Inconsistency("an edge that meets no wall")
        _, s.wall[node], s.place[node] = best
        self._into_corner(node)
        self._check_distance(node)

    def _scanned_walls(self, edge: TopologicalEdge, rough: FloatArray) -> IntArray:
        near = 3.0 * self.frame.grid.cell
        walls = {
            w
            for a in self.frame.arrises
            if a.pair == edge.pair() and np.hypot(a.xy[0] - rough[0], a.xy[1] - rough[1]) <= near
            for w in a.walls
        }
        return np.array(sorted(walls), np.int64)

    def _into_corner(self, node: int) -> None:
        s, contour = self.skeleton, self.frame.contour
        ends = np.array([s.wall[node], contour.following[s.wall[node]]])
        away = np.hypot(*(contour.vertices[ends] - s.place[node]).T)
        k = int(np.argmin(away))
        if away[k] <= SAME_NODE_M:
            s.vertex[node] = int(ends[k])
            s.place[node] = contour.vertices[ends[k]]

    def reorder(self) -> None:
        """Flip short edges whose neighbours cross each other."""
        s = self.skeleton
        for _ in range(MOST_CHANGES):
            twisted = [(len(e.chain), k) for k, e in enumerate(s.topology.edges) if self._twisted(e)]
            if not twisted:
                return
            # a pair of edges that cross twists what is between them at either end: the shorter chain is the doubtful one
            wrong = s.topology.edges[min(twisted)[1]]
            nodes = wrong.start, wrong.end
            if not flipped(s.topology, wrong):
                raise Inconsistency("edges cross and cannot be flipped")
            s.flips += 1
            for node in nodes:
                self.set_place(node)
        raise Inconsistency("edges cross in every order")

    def _twisted(self, edge: TopologicalEdge) -> bool:
        s = self.skeleton
        if edge.start == edge.end or edge.start not in s.place or edge.end not in s.place:
            return False
        if len(edge.chain) - 1 > 2 * NODE_CELLS:
            return False
        if edge.inner():
            ends = [n for n in (edge.start, edge.end) if not s.topology.on_contour(n)]
            outside = [n for n in ends if not shapely.contains_xy(self.frame.outline, *s.place[n])]
            if len(ends) == 1 and outside:
                return True
        return any(self._cross_beside(edge, side) for side in (edge.left, edge.right) if side >= 0)

    def _cross_beside(self, edge: TopologicalEdge, side: int) -> bool:
        """Do the edges that bound one surface before and after this one cross?"""
        s = self.skeleton
        pairs = []
        for node in (edge.start, edge.end):
            beside = [e for e in s.topology.at[node] if e is not edge and e.inner() and side in (e.left, e.right)]
            if len(beside) != 1 or beside[0].other(node) not in s.place:
                return False
            pairs.append((s.place[node], s.place[beside[0].other(node)], beside[0].other(node)))
        (a, b, m), (c, d, n) = pairs
        if m == n or m == edge.end or n == edge.start:
            return False
        return _cross(a, b, c, d)

    def merge_near(self) -> None:
        """Make one node of those that are too near to be told apart."""
        s = self.skeleton
        for _ in range(MOST_CHANGES):
            near = [(self._length(e), k) for k, e in enumerate(s.topology.edges) if self._is_short(e)]
            if not near:
                return
            edge = s.topology.edges[min(near)[1]]
            self._contract(edge)
            s.merged += 1
        raise Inconsistency("too many nodes are too close to each other")

    def _length(self, edge: TopologicalEdge) -> float:
        s = self.skeleton
        return float(np.hypot(*(s.place[edge.start] - s.place[edge.end])))

    def _is_short(self, edge: TopologicalEdge) -> bool:
        s = self.skeleton
        if edge.start == edge.end or edge.start not in s.place or edge.end not in s.place:
            return False
        if edge.inner():
            return self._length(edge) < SAME_NODE_M
        return self._length(edge) < min(SAME_NODE_M, 0.1)

    def _contract(self, edge: TopologicalEdge) -> None:
        s, (keep, gone) = self.skeleton, (edge.start, edge.end)
        contour = [n for n in (keep, gone) if s.topology.on_contour(n)]
        strong = next((n for n in contour if n in s.vertex), contour[0] if contour else None)
        middle = (s.place[keep] + s.place[gone]) / 2 if strong is None else s.place[strong]
        for known in (s.wall, s.vertex):
            value = known.get(strong) if strong is not None else None
            known.pop(gone, None)
            known.pop(keep, None)
            if value is not None:
                known[keep] = value
        s.place.pop(gone)
        s.place[keep] = middle
        contracted(s.topology, edge)

    def tie(self) -> None:
        """Let planes pass through the nodes where more of them meet than a point needs; then place the other nodes anew."""
        s = self.skeleton
        topology = s.topology
        ties = []
        for node, xy in sorted(s.place.items()):
            planes = sorted({topology.plane_of[k] for k in topology.surfaces(node)})
            free = 3 if node not in s.wall else (1 if node in s.vertex else 2)
            if len(planes) > free:
                ties.append((node, xy, planes))
        if not ties:
            return
        before = s.planes
        s.planes = through_ties(before, self.frame.sums, [(xy, planes) for _, xy, planes in ties])
        s.ties = len(ties)
        self._check_moves(before)
        for node in sorted(set(s.place) - {node for node, _, _ in ties}):
            self.set_place(node)

    def _check_moves(self, before: FloatArray) -> None:
        s = self.skeleton
        for node, xy in s.place.items():
            for surface in s.topology.surfaces(node):
                k = s.topology.plane_of[surface]
                change = s.planes[k] - before[k]
                if abs(float(change[:2] @ xy + change[2])) > TIE_M:
                    raise Inconsistency(
                        f"the surfaces of a node are {abs(float(change[:2] @ xy + change[2])):.2f} m apart"
                    )


def _cross(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Do two segments cross, not merely touch?"""

    def side(p: FloatArray, q: FloatArray, r: FloatArray) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0
