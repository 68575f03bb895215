"""Found share of the length of walls: points along true walls, and their distance from the found boundary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray

STEP_M = 0.25
"""Spacing of the places along walls."""
ALIKE_DEG = 20.0
"""Walls that turn more are others; set by hand."""
_CHUNK = 20_000
"""Places at a time; bounds memory."""


@dataclass(frozen=True, slots=True)
class WallStretches:
    """Places along walls, about `STEP_M` apart.

    Attributes
    ----------
    xy : (N, 2) world metres
    direction : (N, 2) unit vector along the wall
    length : (N,) metres of wall that each place stands for
    """

    xy: FloatArray
    direction: FloatArray
    length: FloatArray

    def take(self, chosen: BoolArray) -> WallStretches:
        return WallStretches(self.xy[chosen], self.direction[chosen], self.length[chosen])


def stretches_of(edges: Sequence[LineString]) -> WallStretches:
    """Places along straight edges; their ends are none, so that a corner belongs to no wall."""
    xy, direction, length = [np.empty((0, 2))], [np.empty((0, 2))], [np.empty(0)]
    for edge in edges:
        a, b = shapely.get_coordinates(edge)[[0, -1]]
        count = max(1, round(edge.length / STEP_M)) if edge.length > 0 else 0
        along = (np.arange(count) + 0.5)[:, None] / max(count, 1)
        xy.append(a + along * (b - a))
        direction.append(np.broadcast_to((b - a) / max(float(edge.length), 1e-12), (count, 2)))
        length.append(np.full(count, edge.length / max(count, 1)))
    return WallStretches(np.concatenate(xy), np.concatenate(direction), np.concatenate(length))


def edges_of(polygons: Sequence[Polygon]) -> list[LineString]:
    """Straight edges of all rings, the inside to the left of each."""
    every = shapely.simplify(np.array(list(polygons), dtype=object), 1e-3)
    rings = shapely.get_rings(shapely.orient_polygons(every)) if len(polygons) else []
    corners = [shapely.get_coordinates(ring) for ring in rings]
    return [LineString(xy[k : k + 2]) for xy in corners for k in range(len(xy) - 1)]


def found_along(found: Sequence[Polygon], walls: WallStretches, within_m: float) -> BoolArray:
    """(N,) whether an edge of the found outlines runs within `within_m` of each place, in about the wall's direction."""
    edges = edges_of(found)
    result = np.zeros(len(walls.xy), bool)
    if not edges:
        return result
    lines = np.array(edges, dtype=object)
    ends = shapely.get_coordinates(lines).reshape(-1, 2, 2)
    d = ends[:, 1] - ends[:, 0]
    d /= np.maximum(np.hypot(*d.T), 1e-12)[:, None]
    tree = shapely.STRtree(lines)
    for first in range(0, len(walls.xy), _CHUNK):
        part = slice(first, first + _CHUNK)
        place, edge = tree.query(shapely.points(walls.xy[part]), predicate="dwithin", distance=within_m)
        alike = np.abs((walls.direction[part][place] * d[edge]).sum(axis=1)) >= np.cos(np.radians(ALIKE_DEG))
        result[first + place[alike]] = True
    return result


def length_found(found: Sequence[Polygon], walls: WallStretches, within_m: float) -> float:
    """Share of the walls' length that was found, 0 to 1; NaN where there is no wall."""
    total = float(walls.length.sum())
    return float(walls.length[found_along(found, walls, within_m)].sum() / total) if total > 0 else float("nan")
