"""Steps of a model's roof: the straight walls between a higher and a lower part, with the planes on both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.edges.edge_line import LEAST_LENGTH_M, EdgeLine
from cityflow.reconstruction.overhangs.faces_at_edges import BESIDE_M, face_planes, faces_beside

LEAST_STEP_M = 0.4
"""Lower steps show no edge that could be told from others; set by hand."""
INNER_M = 0.02
"""What is nearer to the outline stands on it."""
ON_LINE_M, PARALLEL = 2e-3, 2e-3
"""Walls on one line: metres off it, and sine of the angle between them; vertices are multiples of 0.1 mm."""


@dataclass(frozen=True, slots=True)
class RoofStep:
    """Walls of a model on one line that hang together, and move together.

    Attributes
    ----------
    points : numbers of their places in plan
    normal : (2,) unit vector across them
    edges : the upper edge of each of them, in whose direction `turned` is 1, or −1 where its lower part is on the other side of the line
    """

    points: frozenset[int]
    normal: FloatArray
    edges: tuple[EdgeLine, ...]
    turned: tuple[int, ...]


def plan_points(solid: Polyhedron) -> IntArray:
    """(V,) number of the place in plan that each vertex stands on."""
    _, number = np.unique(np.rint(solid.vertices[:, :2] * 1e4).astype(np.int64), axis=0, return_inverse=True)
    return np.asarray(number.reshape(-1), np.int64)


class _Wall(NamedTuple):
    """A wall in plan: numbers of its places, start, unit vectors along it and outwards, and its length."""

    points: frozenset[int]
    start: FloatArray
    along: FloatArray
    outward: FloatArray
    length: float

    @property
    def middle(self) -> FloatArray:
        return self.start + self.length / 2 * self.along


class _Roofs(NamedTuple):
    """Faces of a roof in plan, and (F, 3) their planes, as `face_planes` has them, local to `origin` (3,)."""

    polygons: list[Polygon]
    planes: FloatArray
    origin: FloatArray


def roof_steps(solid: Polyhedron, outline: Polygon) -> list[RoofStep]:
    """All steps between parts of the roof, in the order of the model's faces."""
    origin = np.floor(solid.vertices.min(axis=0))
    roofs = _Roofs(*face_planes(solid, origin), origin)
    shapely.prepare(roofs.polygons)
    place, border = plan_points(solid), outline.boundary
    walls, edges = [], []
    for face in solid.of_semantic(Semantic.WALL):
        wall = _wall_of(face, solid, place)
        if wall is None or shapely.distance(border, shapely.Point(wall.middle)) < INNER_M:
            continue
        edge = _upper_edge(wall, roofs)
        if edge is not None:
            walls.append(wall)
            edges.append(edge)
    return [_step([walls[k] for k in group], [edges[k] for k in group]) for group in _groups(walls)]


def _wall_of(face: Face, solid: Polyhedron, place: IntArray) -> _Wall | None:
    """None of a face without an area."""
    ring = solid.ring(face.rings[0])
    near = ring - ring[0]
    normal = np.cross(near, np.roll(near, -1, axis=0)).sum(axis=0)[:2]
    size = float(np.hypot(*normal))
    if size < 1e-9:
        return None
    outward = normal / size
    along = np.array([-outward[1], outward[0]])
    s = ring[:, :2] @ along
    points = frozenset(int(place[v]) for r in face.rings for v in r)
    return _Wall(points, ring[int(s.argmin()), :2], along, outward, float(np.ptp(s)))


def _upper_edge(wall: _Wall, roofs: _Roofs) -> EdgeLine | None:
    """With the planes beside the wall; None where it is short or low."""
    middle = wall.middle - roofs.origin[:2]
    sides = faces_beside(roofs.polygons, middle + np.array([[-BESIDE_M], [BESIDE_M]]) * wall.outward)
    if wall.length < LEAST_LENGTH_M or (sides < 0).any():
        return None
    planes = roofs.planes[sides]
    upper, lower = planes[:, :2] @ middle + planes[:, 2]
    if upper - lower < LEAST_STEP_M:
        return None
    slope = np.array([planes[0, :2] @ wall.along, planes[0, :2] @ wall.outward])
    height = float(upper + roofs.origin[2])
    return EdgeLine(wall.start, wall.along, wall.outward, wall.length, height, slope, float(upper - lower))


def _groups(walls: Sequence[_Wall]) -> list[list[int]]:
    """Numbers of the walls that are one step: on one line, and sharing a place in plan."""
    groups: list[list[int]] = []
    for number, wall in enumerate(walls):
        mine = [g for g in groups if any(_on_one_line(walls[k], wall) for k in g)]
        groups = [g for g in groups if g not in mine] + [sorted([*(k for g in mine for k in g), number])]
    return sorted(groups)


def _on_one_line(a: _Wall, b: _Wall) -> bool:
    if not a.points & b.points or abs(a.along @ b.outward) > PARALLEL:
        return False
    ends = b.start + np.array([[0.0], [b.length]]) * b.along
    return bool(np.abs((ends - a.start) @ a.outward).max() < ON_LINE_M)


def _step(walls: Sequence[_Wall], edges: Sequence[EdgeLine]) -> RoofStep:
    normal = walls[0].outward
    turned = tuple(1 if w.outward @ normal > 0 else -1 for w in walls)
    return RoofStep(frozenset().union(*(w.points for w in walls)), normal, tuple(edges), turned)
