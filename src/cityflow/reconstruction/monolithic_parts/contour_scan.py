"""Arrises: where the surface along the contour changes, found by scanning it linearly, and circularly around its corners.

Frommholz 2017, section 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.monolithic_parts.cell_grid import CellGrid

INSET_CELLS, STEP_CELLS, RADIUS_CELLS = 0.75, 0.5, 2.0
"""How far inside a wall, how densely, and how far around a corner labels are read, cells; not decisive: half and twice gave the same models of 37 units."""
ARC_STEPS = 24
"""Places on such an arc; not decisive, as above."""


@dataclass(frozen=True, slots=True)
class Contour:
    """The walls of an outline, ring by ring in its own order.

    Attributes
    ----------
    vertices : (V, 2) float64, local, metres, all rings in their order
    following : (V,) int64, next vertex in the ring: wall k runs from vertex k to `following[k]`
    inward : (V, 2) float64, unit vector of wall k towards the inside
    """

    vertices: FloatArray
    following: IntArray
    inward: FloatArray

    @classmethod
    def of(cls, outline: Polygon) -> Contour:
        parts, following, inward, first = [], [], [], 0
        for number, ring in enumerate((outline.exterior, *outline.interiors)):
            xy = np.asarray(ring.coords)[:-1, :2]
            onward = np.roll(np.arange(len(xy)), -1)
            along = xy[onward] - xy
            along = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
            # the inside is on the left of a counter-clockwise exterior and of a clockwise hole
            sign = 1.0 if ring.is_ccw == (number == 0) else -1.0
            parts.append(xy)
            following.append(onward + first)
            inward.append(sign * np.column_stack([-along[:, 1], along[:, 0]]))
            first += len(xy)
        return cls(np.concatenate(parts), np.concatenate(following).astype(np.int64), np.concatenate(inward))

    def preceding(self) -> IntArray:
        """(V,) the vertex before each one."""
        back = np.empty_like(self.following)
        back[self.following] = np.arange(len(self.following))
        return back

    def crossings(self, normal: FloatArray, offset: float) -> tuple[IntArray, FloatArray]:
        """Walls that a line normal·x = offset meets, and (K, 2) places where."""
        start, end = self.vertices, self.vertices[self.following]
        s, e = start @ normal - offset, end @ normal - offset
        walls = np.flatnonzero(((s <= 0) & (e >= 0) | (s >= 0) & (e <= 0)) & (s != e))
        t = (s[walls] / (s[walls] - e[walls]))[:, None]
        return walls, start[walls] + t * (end[walls] - start[walls])


@dataclass(frozen=True, slots=True)
class Arris:
    """A change of surface at the contour.

    Attributes
    ----------
    xy : where, local metres
    pair : the two surfaces, the smaller number first
    walls : the wall that it was seen on, or the two at a corner
    corner : vertex of the contour whose surroundings it was seen in, else −1
    """

    xy: tuple[float, float]
    pair: tuple[int, int]
    walls: tuple[int, ...]
    corner: int = -1


def scan_contour(contour: Contour, labels: IntArray, grid: CellGrid) -> list[Arris]:
    """All arrises, along the walls first."""
    return [*_along_walls(contour, labels, grid), *_around_corners(contour, labels, grid)]


def _label_at(labels: IntArray, grid: CellGrid, xy: FloatArray) -> IntArray:
    cell = grid.cell_of(xy)
    return np.where(cell >= 0, labels.ravel()[np.maximum(cell, 0)], -1)


def _along_walls(contour: Contour, labels: IntArray, grid: CellGrid) -> list[Arris]:
    found = []
    for wall, inward in enumerate(contour.inward):
        a, b = contour.vertices[wall], contour.vertices[contour.following[wall]]
        length = float(np.hypot(*(b - a)))
        count = max(int(length / (STEP_CELLS * grid.cell)), 2)
        on_wall = a + ((np.arange(count) + 0.5) / count)[:, None] * (b - a)
        seen = _label_at(labels, grid, on_wall + INSET_CELLS * grid.cell * inward)
        found += _changes(seen, on_wall, (wall,))
    return found


def _around_corners(contour: Contour, labels: IntArray, grid: CellGrid) -> list[Arris]:
    """What an arc from one wall to the other sees that starts at each corner."""
    found = []
    for corner, before in enumerate(contour.preceding()):
        here = contour.vertices[corner]
        first = contour.vertices[contour.following[corner]] - here
        last = contour.vertices[before] - here
        start = math.atan2(first[1], first[0])
        sweep = (math.atan2(last[1], last[0]) - start) % (2 * math.pi)
        if contour.inward[corner] @ (-first[1], first[0]) < 0:
            sweep -= 2 * math.pi
        angle = start + sweep * (np.arange(ARC_STEPS) + 0.5) / ARC_STEPS
        arc = here + RADIUS_CELLS * grid.cell * np.column_stack([np.cos(angle), np.sin(angle)])
        seen = _label_at(labels, grid, arc)
        found += [
            Arris((float(here[0]), float(here[1])), a.pair, a.walls, corner)
            for a in _changes(seen, arc, (int(before), corner))
        ]
    return found


def _changes(seen: IntArray, xy: FloatArray, walls: tuple[int, ...]) -> list[Arris]:
    known = np.flatnonzero(seen >= 0)
    labels = seen[known]
    found = []
    for k in np.flatnonzero(labels[1:] != labels[:-1]):
        x, y = (xy[known[k]] + xy[known[k + 1]]) / 2
        pair = int(min(labels[k], labels[k + 1])), int(max(labels[k], labels[k + 1]))
        found.append(Arris((float(x), float(y)), pair, walls))
    return found
