"""Hulls of made units as they truly are: roofs, walls under them, steps between roofs, and what stands out beyond the walls.

They are open shells for looking at, not solids: their faces are where the town's mesh has them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Polyhedron, RoofPlane, Semantic
from cityflow.evaluation.models import TrueModel
from cityflow.synthetic.town_shapes import SLAB_M

LEAST_M2, LEAST_M, STEP_M, TOUCH_M = 0.01, 0.02, 0.02, 0.01

Ring = FloatArray


def true_shells(truth: TrueModel, floor_m: float) -> tuple[Polyhedron, Polyhedron | None]:
    """What stands on the walls' outline, and what stands out beyond it (None where nothing does)."""
    on_walls = [(part, plane) for polygon, plane in truth.surfaces for part in _parts(polygon, truth.walls)]
    faces = [(_lifted(part, plane), Semantic.ROOF) for part, plane in on_walls]
    faces += [(rings, Semantic.WALL) for rings in _walls(truth.walls, on_walls, floor_m)]
    faces += [(rings, Semantic.WALL) for rings in _steps(on_walls)]
    out = shapely.difference(truth.roof, truth.walls)
    beyond = [(part, plane) for polygon, plane in truth.surfaces for part in _parts(polygon, out)]
    overhang = [(_lifted(part, plane), Semantic.ROOF) for part, plane in beyond]
    overhang += [(_under(part, plane), Semantic.OUTER_CEILING) for part, plane in beyond]
    return _shell(faces), _shell(overhang) if overhang else None


def _parts(polygon: Polygon, area: shapely.Geometry) -> list[Polygon]:
    common = shapely.intersection(polygon, area)
    return [p for p in shapely.get_parts(common) if isinstance(p, Polygon) and p.area > LEAST_M2]


def _lifted(polygon: Polygon, plane: RoofPlane) -> list[Ring]:
    turned = shapely.geometry.polygon.orient(polygon)
    rings = [shapely.get_coordinates(r)[:-1] for r in (turned.exterior, *turned.interiors)]
    return [np.column_stack([xy, plane.z(*xy.T)]) for xy in rings]


def _under(polygon: Polygon, plane: RoofPlane) -> list[Ring]:
    return [(ring - (0.0, 0.0, SLAB_M))[::-1] for ring in _lifted(polygon, plane)]


def _walls(walls: Polygon, roofs: list[tuple[Polygon, RoofPlane]], floor_m: float) -> Iterator[list[Ring]]:
    """Under every piece of an edge with one roof over it, a face from floor to roof."""
    outline = shapely.geometry.polygon.orient(walls)
    for ring in (outline.exterior, *outline.interiors):
        for a, b in itertools.pairwise(shapely.get_coordinates(ring)):
            for polygon, plane in roofs:
                for p, q in _pieces(a, b, polygon):
                    top = plane.z(*np.array([q, p]).T)
                    yield [np.array([[*p, floor_m], [*q, floor_m], [*q, top[0]], [*p, top[1]]])]


def _pieces(a: FloatArray, b: FloatArray, polygon: Polygon) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Pieces of an edge that a roof stands on, in the edge's direction."""
    inward = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
    line = LineString([a + TOUCH_M * inward, b + TOUCH_M * inward])
    for part in shapely.get_parts(shapely.intersection(line, polygon)):
        if isinstance(part, LineString) and part.length > LEAST_M:
            ends = shapely.get_coordinates(part)[[0, -1]] - TOUCH_M * inward
            if (ends[1] - ends[0]) @ (b - a) < 0:
                ends = ends[::-1]
            yield ends[0], ends[1]


def _steps(roofs: list[tuple[Polygon, RoofPlane]]) -> Iterator[list[Ring]]:
    """Upright faces between roofs of different height, seen from the lower one."""
    for (one, high), (other, low) in itertools.permutations(roofs, 2):
        turned = shapely.get_coordinates(shapely.geometry.polygon.orient(one).exterior)
        for a, b in itertools.pairwise(turned):
            outward = np.array([b[1] - a[1], a[0] - b[0]]) / np.hypot(*(b - a))
            line = LineString([a + TOUCH_M * outward, b + TOUCH_M * outward])
            for part in shapely.get_parts(shapely.intersection(line, other)):
                if not isinstance(part, LineString) or part.length < LEAST_M:
                    continue
                p, q = sorted(
                    shapely.get_coordinates(part)[[0, -1]] - TOUCH_M * outward, key=lambda x: float(x @ (b - a))
                )
                tops, feet = high.z(*np.array([p, q]).T), low.z(*np.array([p, q]).T)
                if np.max(tops - feet) > STEP_M:
                    yield [_above(np.array([p, q]), tops, feet)]


def _above(ends: FloatArray, tops: FloatArray, feet: FloatArray) -> Ring:
    """The upright face between two lines over a piece of an edge, as far as the first is above the second."""
    rise = tops - feet
    if np.all(rise >= 0):
        return np.column_stack([ends[[0, 1, 1, 0]], [*feet, tops[1], tops[0]]])
    share = rise[0] / (rise[0] - rise[1])
    meet = np.append(ends[0] + share * (ends[1] - ends[0]), feet[0] + share * (feet[1] - feet[0]))
    if rise[0] > 0:
        return np.array([[*ends[0], feet[0]], meet, [*ends[0], tops[0]]])
    return np.array([meet, [*ends[1], feet[1]], [*ends[1], tops[1]]])


def _shell(faces: list[tuple[list[Ring], Semantic]]) -> Polyhedron:
    vertices, made, count = [], [], 0
    for rings, semantic in faces:
        numbered = []
        for ring in rings:
            numbered.append(tuple(range(count, count + len(ring))))
            vertices.append(ring)
            count += len(ring)
        made.append(Face(tuple(numbered), semantic))
    return Polyhedron(np.concatenate(vertices), tuple(made))
