"""Constrained Delaunay triangulation of points and lines, by splitting no line and adding no point.

Delaunay first; each wanted edge that is missing is then made by flipping the edges that cross it (Sloan 1993), and
the edges flipped are made Delaunay again where the constraints allow it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.spatial import Delaunay

from cityflow.core.arrays import FloatArray, IntArray

Edge = tuple[int, int]


def triangulate(xy: FloatArray, lines: Sequence[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Vertices (V, 2) without duplicates in lexical order, and counter-clockwise triangles (T, 3) over their hull.

    Every segment of `lines` whose ends are vertices becomes an edge, in pieces where it runs over further vertices.
    """
    xy = np.unique(np.concatenate([xy, *lines]), axis=0)
    mesh = _Mesh(xy)
    number = {(float(x), float(y)): i for i, (x, y) in enumerate(xy)}
    for line in lines:
        for a, b in pairwise(line):
            i, j = number[float(a[0]), float(a[1])], number[float(b[0]), float(b[1])]
            if i != j:
                mesh.force(i, j)
    return xy, mesh.triangles()


class _Mesh:
    """Triangles as a map from directed edge to the vertex on its left."""

    def __init__(self, xy: FloatArray) -> None:
        local = xy - xy.mean(axis=0)
        self.at = [(float(x), float(y)) for x, y in local]
        self.apex: dict[Edge, int] = {}
        self.fixed: set[Edge] = set()
        self.around: dict[int, set[int]] = {i: set() for i in range(len(xy))}
        for a, b, c in Delaunay(local).simplices.tolist():
            area = self._turn(a, b, c)
            if area != 0:
                self._add(*((a, b, c) if area > 0 else (a, c, b)))

    def triangles(self) -> IntArray:
        """(T, 3) vertex indices; each triangle starts at its smallest one."""
        found = sorted((a, b, c) for (a, b), c in self.apex.items() if a < b and a < c)
        return np.array(found, np.int64).reshape(-1, 3)

    def force(self, i: int, j: int) -> None:
        """Make edge i-j, in pieces where vertices lie on it."""
        stack = [(i, j)]
        while stack:
            a, b = stack.pop()
            through = self._crossed(a, b)
            if isinstance(through, int):
                stack += [(through, b), (a, through)]
                continue
            self._flip_away(a, b, through)
            self.fixed |= {(a, b), (b, a)}

    def _add(self, a: int, b: int, c: int) -> None:
        for edge, apex in (((a, b), c), ((b, c), a), ((c, a), b)):
            self.apex[edge] = apex
            self.around[edge[0]].add(edge[1])
            self.around[edge[1]].add(edge[0])

    def _turn(self, a: int, b: int, c: int) -> float:
        (x_a, y_a), (x_b, y_b), (x_c, y_c) = self.at[a], self.at[b], self.at[c]
        return (x_b - x_a) * (y_c - y_a) - (y_b - y_a) * (x_c - x_a)

    def _side(self, a: int, b: int, c: int) -> int:
        """1 left of a→b, -1 right, 0 within 0.02 mm of the line."""
        turn = self._turn(a, b, c)
        (x_a, y_a), (x_b, y_b) = self.at[a], self.at[b]
        limit = 2e-5 * ((x_b - x_a) ** 2 + (y_b - y_a) ** 2) ** 0.5
        return 0 if abs(turn) <= limit else (1 if turn > 0 else -1)

    def _ahead(self, a: int, b: int, c: int) -> bool:
        (x_a, y_a), (x_b, y_b), (x_c, y_c) = self.at[a], self.at[b], self.at[c]
        return (x_b - x_a) * (x_c - x_a) + (y_b - y_a) * (y_c - y_a) > 0

    def _crossed(self, a: int, b: int) -> list[Edge] | int:
        """Edges (right, left) that a→b crosses, in order; or a vertex that lies on the way."""
        if b in self.around[a]:
            return []
        for right in sorted(self.around[a]):
            left = self.apex.get((a, right))
            if self._side(a, b, right) == 0 and self._ahead(a, b, right):
                return right
            if left is not None and self._side(a, b, right) < 0 < self._side(a, b, left):
                break
        else:
            raise ValueError(f"no triangle leads from vertex {a} towards {b}")
        crossed = []
        while True:
            crossed.append((right, left))
            beyond = self.apex[left, right]
            if beyond == b:
                return crossed
            side = self._side(a, b, beyond)
            if side == 0:
                return beyond
            right, left = (right, beyond) if side > 0 else (beyond, left)

    def _flip_away(self, a: int, b: int, crossed: list[Edge]) -> None:
        queue, made = list(crossed), []
        budget = 50 * (len(crossed) + 1) ** 2
        while queue:
            budget -= 1
            if budget < 0:
                raise ValueError(f"edge {a}-{b} crosses another constraint")
            p, q = queue.pop(0)
            r, s = self.apex[p, q], self.apex[q, p]
            if not self._is_convex(p, q, r, s):
                queue.append((p, q))
                continue
            self._flip(p, q)
            if {r, s} == {a, b}:
                continue
            if {r, s} & {a, b} or self._side(a, b, r) * self._side(a, b, s) >= 0:
                made.append((r, s))
            else:
                queue.append((r, s))
        self.fixed |= {(a, b), (b, a)}
        self._legalise(made)

    def _is_convex(self, p: int, q: int, r: int, s: int) -> bool:
        """Whether the diagonal p-q of the quadrilateral p, s, q, r may be flipped."""
        return (p, q) not in self.fixed and self._side(s, r, p) * self._side(s, r, q) < 0

    def _flip(self, p: int, q: int) -> Edge:
        r, s = self.apex.pop((p, q)), self.apex.pop((q, p))
        self.around[p].discard(q)
        self.around[q].discard(p)
        self._add(p, s, r)
        self._add(s, q, r)
        return r, s

    def _legalise(self, edges: list[Edge]) -> None:
        """Flip edges inside their neighbours' circumcircle, a bounded number of times."""
        for _ in range(20 * len(edges)):
            if not edges:
                return
            p, q = edges.pop()
            if (p, q) in self.fixed or (p, q) not in self.apex or (q, p) not in self.apex:
                continue
            r, s = self.apex[p, q], self.apex[q, p]
            if self._in_circle(p, q, r, s) and self._is_convex(p, q, r, s):
                self._flip(p, q)
                edges += [(p, s), (s, q), (q, r), (r, p)]

    def _in_circle(self, a: int, b: int, c: int, d: int) -> bool:
        rows = []
        for i in (a, b, c):
            x, y = self.at[i][0] - self.at[d][0], self.at[i][1] - self.at[d][1]
            rows.append((x, y, x * x + y * y))
        (x_0, y_0, w_0), (x_1, y_1, w_1), (x_2, y_2, w_2) = rows
        value = x_0 * (y_1 * w_2 - y_2 * w_1) - y_0 * (x_1 * w_2 - x_2 * w_1) + w_0 * (x_1 * y_2 - x_2 * y_1)
        return value > 1e-9 * max(w_0, w_1, w_2) ** 2
