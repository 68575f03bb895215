"""From a partition and planes to a closed solid: roofs, walls where heights differ, a level ground face.

Gross et al. 2005, section 3: walls follow from the borders of the roof polygons (upper edge) and the terrain (lower
edge); here also the walls between roofs of different heights.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import Polygon, get_coordinates

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS, Polyhedron, Semantic
from cityflow.reconstruction.partition.cut_line import ON_LINE, CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.corner_faces import CornerFace, numbered
from cityflow.reconstruction.solids.corner_heights import OUTSIDE, CornerHeights
from cityflow.reconstruction.solids.ring_tracing import group_rings, trace_rings
from cityflow.reconstruction.solids.touching_rings import pulled_apart
from cityflow.reconstruction.solids.wall_merging import Wall, merge_walls

MIN_HEIGHT = 0.5
"""Where a roof would come nearer to the floor than this (m) it is cut and laid level at this height, or, where no cut is possible, at its mean; set by hand."""

STRAIGHT = 5e-4
"""A corner of two faces only that lies this near (m) to the line between its neighbours is left out."""

Corner = tuple[int, int]
"""A vertex of the solid: vertex in plan, and level there."""


def assemble(
    partition: RoofPartition,
    coefficients: FloatArray,
    floor: float,
    origin: tuple[float, float, float],
    outline: Polygon | None = None,
) -> Polyhedron:
    """The solid between the roof and a level floor.

    Parameters
    ----------
    partition : cells in local xy
    coefficients : (P, 3) a, b, c of z = a·x + b·y + c, local
    floor : world height of the ground face, metres
    origin : world coordinates of the local origin
    outline : the outline in world coordinates, the same rings in the same order as was partitioned; its vertices are
        taken over bit for bit (rings that touch are pulled apart by 3 mm there). Without it they are those of the partition, rounded like all others.
    """
    division, labels = partition.subdivision()
    world = _world_xy(partition, origin, outline)
    division.xy = [(float(x - origin[0]), float(y - origin[1])) for x, y in world]
    for vertex, (x, y) in pulled_apart(division).items():
        world[vertex] = np.round((x + origin[0], y + origin[1]), VERTEX_DECIMALS)
        division.xy[vertex] = (float(world[vertex, 0] - origin[0]), float(world[vertex, 1] - origin[1]))
    local_floor = floor - origin[2]
    _cut_at_least_height(division, labels, coefficients, local_floor + MIN_HEIGHT)
    planes = {cell: _above_floor(division, cell, coefficients[p], local_floor) for cell, p in labels.items()}
    numbers = {
        tuple(map(float, plane)): labels[c]
        for c, plane in planes.items()
        if np.array_equal(plane, coefficients[labels[c]])
    }
    heights = CornerHeights(division, planes, local_floor)
    heights.split_crossings()
    heights.part_corners()
    return _Shell(heights, numbers, _all_world_xy(division, world, origin), origin[2], floor).polyhedron()


def _world_xy(partition: RoofPartition, origin: Sequence[float], outline: Polygon | None) -> FloatArray:
    world = np.round(partition.vertices + np.asarray(origin[:2]), VERTEX_DECIMALS)
    if outline is None:
        return world
    rings = [get_coordinates(ring)[:-1] for ring in (outline.exterior, *outline.interiors)]
    exact = np.concatenate(rings)
    n = partition.outline_vertices
    if len(exact) != n or np.abs(exact - world[:n]).max() > 1e-3:
        raise ValueError("the outline is not the one that was partitioned")
    world[:n] = exact
    return world


def _all_world_xy(division: Subdivision, world: FloatArray, origin: Sequence[float]) -> FloatArray:
    added = np.array(division.xy[len(world) :]).reshape(-1, 2) + np.asarray(origin[:2])
    return np.concatenate([world, np.round(added, VERTEX_DECIMALS)])


def _cut_at_least_height(division: Subdivision, labels: dict[int, int], coefficients: FloatArray, least: float) -> None:
    """Cut the cells whose planes pass the least height: a sliver of the outline, over which a plane falls to the ground, does not cost the roof its plane."""
    for cell, number in list(labels.items()):
        a, b, c = coefficients[number].tolist()
        slope, z = math.hypot(a, b), _heights(division, cell, coefficients[number])
        if slope > 0 and z.min() < least < z.max():
            line = CutLine(a / slope, b / slope, (least - c) / slope, -math.inf, math.inf, 0.0)
            del labels[cell]
            labels.update(dict.fromkeys(division.cut(cell, line), number))


def _heights(division: Subdivision, cell: int, plane: FloatArray) -> FloatArray:
    return np.array([division.xy[v] for v in division.cells[cell][0]]) @ plane[:2] + plane[2]


def _above_floor(division: Subdivision, cell: int, plane: FloatArray, floor: float) -> FloatArray:
    z, on_line = _heights(division, cell, plane), ON_LINE * math.hypot(*plane[:2])
    if z.min() >= floor + MIN_HEIGHT - 2 * on_line:
        return plane
    return np.array([0.0, 0.0, max(float(z.mean()), floor + MIN_HEIGHT)])


@dataclass(frozen=True, slots=True)
class _Shell:
    """Faces over a subdivision whose corners have heights."""

    heights: CornerHeights
    plane_numbers: dict[tuple[float, ...], int]
    world_xy: FloatArray
    z0: float
    floor: float

    def polyhedron(self) -> Polyhedron:
        level, cells = self.heights.level, self.heights.division.cells
        faces = [
            CornerFace(
                tuple(tuple((v, level[v, cell]) for v in ring) for ring in rings),
                Semantic.ROOF,
                self.plane_numbers.get(tuple(map(float, self.heights.planes[cell])), -1),
            )
            for cell, rings in sorted(cells.items())
        ]
        faces += [CornerFace((ring,), Semantic.WALL) for ring in merge_walls(self._walls(), self.world_xy)]
        faces += [CornerFace(rings, Semantic.GROUND) for rings in self._ground()]
        return numbered(faces, self._position, self._is_needed)

    def _position(self, corner: Corner) -> tuple[float, float, float]:
        vertex, level = corner
        on_floor = self.heights.level.get((vertex, OUTSIDE)) == level
        z = self.floor if on_floor else round(self.heights.levels[vertex][level] + self.z0, VERTEX_DECIMALS)
        return float(self.world_xy[vertex, 0]), float(self.world_xy[vertex, 1]), z

    def _ground(self) -> list[tuple[tuple[Corner, ...], ...]]:
        division, level = self.heights.division, self.heights.level
        border = [(u, v) for u, v in division.left if (v, u) not in division.left]
        parts = group_rings(trace_rings(border, division.xy), division.xy)
        return [tuple(tuple((v, level[v, OUTSIDE]) for v in reversed(ring)) for ring in part) for part in parts]

    def _walls(self) -> list[Wall]:
        """A wall for every edge, on the side of the higher cell, and the number of the outline edge it stands on."""
        division, walls = self.heights.division, []
        edges_of_outline = division.outline_edges()
        for u, v in sorted(division.left):
            left, right = division.left[u, v], division.left.get((v, u), OUTSIDE)
            start, end = self.heights.step(u, left, right), self.heights.step(v, left, right)
            if max(start, end) > 0:
                walls.append(Wall(self._wall_ring(u, v, left, right), (u, v), edges_of_outline.get((u, v), -1)))
        return walls

    def _wall_ring(self, u: int, v: int, high: int, low: int) -> tuple[Corner, ...]:
        level = self.heights.level
        up = [(v, k) for k in range(level[v, low], level[v, high] + 1)]
        down = [(u, k) for k in range(level[u, high], level[u, low] - 1, -1)]
        return (*up, *down)

    def _is_needed(self, corner: Corner, around: set[Corner]) -> bool:
        if corner[0] < self.heights.division.fixed or len(around) != 2:
            return True
        (x, y, z), (x0, y0, z0), (x1, y1, z1) = (self._position(c) for c in (corner, *sorted(around)))
        ax, ay, az, bx, by, bz = x - x0, y - y0, z - z0, x1 - x0, y1 - y0, z1 - z0
        off = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
        return off > STRAIGHT * math.hypot(bx, by, bz)
