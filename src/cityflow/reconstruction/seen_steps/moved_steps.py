"""A solid whose inner walls stand elsewhere in plan; its planes and its outline stay."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import VERTEX_DECIMALS, Polyhedron, Semantic
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.seen_steps.edge_lines import PARALLEL, RoofStep, plan_points

LEAST_TURN = float(np.sin(np.radians(15.0)))
"""Lines that turn less do not hold a corner; set by hand."""
SHORTEST_M = 0.05
"""An edge in plan that was changed is at least so long; set by hand."""
MEET_M = 5e-4
"""Lines through one place still meet if they pass so near to each other."""
SAME_HEIGHT_M = 2e-3
"""Roofs that met in a vertex still do if their heights differ by no more."""


@dataclass(frozen=True)
class StepPlan:
    """A solid in plan, with the steps that may move.

    Attributes
    ----------
    solid : Polyhedron;  place : (V,) number of each vertex's place in plan;  xy : (P, 2) places, world metres
    beside : place → the places that an edge of some face joins it to
    fixed : places at vertices of the outline
    gradients : vertex → rise per metre in x and y of each roof face that it belongs to
    """

    solid: Polyhedron
    place: IntArray
    xy: FloatArray
    beside: Mapping[int, frozenset[int]]
    fixed: frozenset[int]
    gradients: Mapping[int, tuple[FloatArray, ...]]

    @classmethod
    def of(cls, solid: Polyhedron, outline: Polygon) -> StepPlan:
        place = plan_points(solid)
        xy = np.empty((int(place.max()) + 1, 2))
        xy[place] = solid.vertices[:, :2]
        beside, gradients = defaultdict[int, set[int]](set), defaultdict[int, list[FloatArray]](list)
        for face in solid.faces:
            for ring in face.rings:
                for a, b in zip(ring, (*ring[1:], ring[0]), strict=True):
                    if place[a] != place[b]:
                        beside[int(place[a])].add(int(place[b]))
                        beside[int(place[b])].add(int(place[a]))
            if face.semantic is Semantic.ROOF:
                corners = [v for ring in face.rings for v in ring]
                gradient = _gradient(solid.vertices[corners])
                for v in corners:
                    gradients[v].append(gradient)
        corners_xy = shapely.get_coordinates(outline)
        away = np.abs(xy[:, None] - corners_xy[None]).max(axis=2).min(axis=1)
        return cls(
            solid, place, xy, {p: frozenset(q) for p, q in beside.items()},
            frozenset(np.flatnonzero(away < 2.0 * 10.0**-VERTEX_DECIMALS).tolist()), {v: tuple(g) for v, g in gradients.items()},
        )  # fmt: skip

    def moved(self, steps: Sequence[tuple[RoofStep, float]]) -> Polyhedron | None:
        """The solid with some steps moved; None where its faces would not meet, or it would not be valid.

        Parameters
        ----------
        steps : each with how far it moves in the direction of its normal, metres
        """
        at = {p: self._moved(p, steps) for p in sorted({p for step, _ in steps for p in step.points})}
        xy = self.xy.copy()
        for p, found in at.items():
            if found is None:
                return None
            xy[p] = found
        if not self._keeps_edges(xy, at):
            return None
        vertices = self.solid.vertices.copy()
        for v in np.flatnonzero(np.isin(self.place, list(at))).tolist():
            z = self._height(v, xy[self.place[v]] - self.xy[self.place[v]])
            if z is None:
                return None
            vertices[v] = *xy[self.place[v]], z
        vertices = np.round(vertices, VERTEX_DECIMALS)
        if not self._keeps_order(vertices, at):
            return None
        made = replace(self.solid, vertices=vertices)
        return None if check_polyhedron(made) else made

    def _moved(self, p: int, steps: Sequence[tuple[RoofStep, float]]) -> FloatArray | None:
        """Where a place stands then: on all its lines, of which some have moved."""
        if p in self.fixed:
            return None
        mine = [(step, by) for step, by in steps if p in step.points]
        normals, offsets = [step.normal for step, _ in mine], [by for _, by in mine]
        for q in sorted(self.beside[p]):
            if any(q in step.points for step, _ in mine):
                continue
            way = (self.xy[q] - self.xy[p]) / np.hypot(*(self.xy[q] - self.xy[p]))
            across = np.array([way[1], -way[0]])
            if not any(abs(way @ n) < PARALLEL and o == 0 for n, o in zip(normals, offsets, strict=True)):
                normals.append(across)
                offsets.append(0.0)
        rows, wanted = np.array(normals), np.array(offsets)
        if len(rows) > 1 and float(np.linalg.svd(rows)[1][1]) < LEAST_TURN / np.sqrt(2.0):
            return None
        by, *_ = np.linalg.lstsq(rows, wanted, rcond=None)
        return self.xy[p] + by if float(np.abs(rows @ by - wanted).max()) <= MEET_M else None

    def _keeps_edges(self, xy: FloatArray, at: Mapping[int, object]) -> bool:
        """Whether the edges at places that have moved still lead the same way, and are long enough."""
        for p in at:
            for q in self.beside[p]:
                before, after = self.xy[q] - self.xy[p], xy[q] - xy[p]
                if before @ after <= 0 or np.hypot(*after) < min(SHORTEST_M, np.hypot(*before)):
                    return False
        return True

    def _height(self, v: int, by: FloatArray) -> float | None:
        """Of a vertex that moves in plan, on its roofs; what belongs to no roof stays on the floor, or cannot move."""
        old = float(self.solid.vertices[v, 2])
        if v not in self.gradients:
            return old if old <= self.solid.vertices[:, 2].min() else None
        z = np.array([old + g @ by for g in self.gradients[v]])
        return float(z.mean()) if np.ptp(z) <= SAME_HEIGHT_M else None

    def _keeps_order(self, vertices: FloatArray, at: Mapping[int, object]) -> bool:
        """Whether what stood above still stands above, at every place that has moved."""
        for p in at:
            mine = np.flatnonzero(self.place == p)
            order = mine[np.argsort(self.solid.vertices[mine, 2], kind="stable")]
            if (np.diff(vertices[order, 2]) <= 0).any():
                return False
        return True


def _gradient(points: FloatArray) -> FloatArray:
    near = points - points.mean(axis=0)
    return np.asarray(np.linalg.lstsq(near[:, :2], near[:, 2], rcond=None)[0])
