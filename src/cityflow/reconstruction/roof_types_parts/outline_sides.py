"""The straight sides of an outline, and the quads of sides that roofs are built over."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.roof_types_parts.roof_lines import turn_between
from cityflow.reconstruction.roof_types_parts.skeletons import Quad

ROUND_SIDES, ROUNDNESS = 8, 0.93
"""An outline of so many sides whose area is nearly that of a disc of the same perimeter is round; set by hand."""


@dataclass(frozen=True, slots=True)
class Sides:
    """Straight sides of an outline's exterior.

    Attributes
    ----------
    ends : (N, 2, 2) float64, counter-clockwise, local metres
    """

    ends: FloatArray

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def length(self) -> FloatArray:
        return np.asarray(np.hypot(*(self.ends[:, 1] - self.ends[:, 0]).T))

    @property
    def angle(self) -> FloatArray:
        """(N,) direction, radians, −π to π."""
        dx, dy = (self.ends[:, 1] - self.ends[:, 0]).T
        return np.asarray(np.arctan2(dy, dx))

    def lines(self) -> FloatArray:
        """(N, 3) nx, ny, c with nx·x + ny·y − c the distance to the left of each side, which is inwards."""
        step = self.ends[:, 1] - self.ends[:, 0]
        normal = np.column_stack([-step[:, 1], step[:, 0]]) / self.length[:, None]
        return np.column_stack([normal, np.sum(normal * self.ends[:, 0], axis=1)])


def sides_of(outline: Polygon, tolerance: float) -> Sides:
    """Sides after small bends are left out."""
    simple = outline.simplify(tolerance)
    if simple.is_empty or simple.geom_type != "Polygon" or len(simple.exterior.coords) < 4:
        simple = outline
    ring = np.asarray(shapely.geometry.polygon.orient(simple).exterior.coords)[:, :2]
    ring = _without_false_start(ring, tolerance)
    return Sides(np.stack([ring[:-1], ring[1:]], axis=1))


def _without_false_start(ring: FloatArray, tolerance: float) -> FloatArray:
    """The ring without its first vertex where that lies within a straight side (simplifying always keeps it)."""
    before, first, after = ring[-2], ring[0], ring[1]
    step = after - before
    away = abs(step[0] * (first - before)[1] - step[1] * (first - before)[0]) / max(float(np.hypot(*step)), 1e-9)
    if len(ring) < 5 or away > tolerance:
        return ring
    return np.concatenate([ring[1:-1], ring[1:2]])


def main_angle(sides: Sides) -> float:
    """Direction (radians, 0 to π/2) that most metres of the outline follow or are square to."""
    folded = sides.angle % (math.pi / 2)
    apart = np.abs((folded[:, None] - folded[None] + math.pi / 4) % (math.pi / 2) - math.pi / 4)
    near = apart <= math.radians(12.0)
    best = int(np.argmax(near @ sides.length))
    turn = (folded[near[best]] - folded[best] + math.pi / 4) % (math.pi / 2) - math.pi / 4
    weight = sides.length[near[best]]
    return float((folded[best] + np.sum(turn * weight) / weight.sum()) % (math.pi / 2))


def whole_quad(outline: Polygon, sides: Sides) -> Quad:
    """Four sides around all of the outline: its own where there are just four, else those of the smallest rectangle."""
    if len(sides) == 4 and _is_quad(sides):
        return Quad(sides.lines()[[0, 2, 3, 1]])
    angle = main_angle(sides)
    ring = np.asarray(outline.exterior.coords)[:-1, :2]
    along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    u, v = ring @ along, ring @ across
    rows = [[*across, v.min()], [*-across, -v.max()], [*along, u.min()], [*-along, -u.max()]]
    return Quad(np.array(rows))


def _is_quad(sides: Sides) -> bool:
    """Opposite sides nearly parallel."""
    a = sides.angle
    return bool(max(turn_between(a[0], a[2]), turn_between(a[1], a[3])) <= math.radians(20.0))


def fills(outline: Polygon, quad: Quad) -> float:
    """Share of the quad that the outline covers, times its own share within the quad."""
    ring = Polygon(quad.ring())
    common = shapely.intersection(ring, outline, grid_size=1e-3).area
    return float(common / ring.area * common / outline.area)


def is_round(outline: Polygon, sides: Sides) -> bool:
    """Many sides around a disc."""
    return len(sides) >= ROUND_SIDES and 4 * math.pi * outline.area >= ROUNDNESS * outline.length**2
