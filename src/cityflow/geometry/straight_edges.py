"""The straight edges of an outline, and which of them touch a neighbour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import OutlineEdge
from cityflow.geometry.recent import remembered

STRAIGHT_DEG = 2.0
"""Pieces of an outline that turn less than this are one edge, as long as their ends stay `STRAIGHT_M` near its line; set by hand."""
STRAIGHT_M = 0.03
"""Metres; set by hand."""
ON_PARTY_M = 0.01
"""An edge so near to a neighbour's is a party wall's: outlines are noded more finely; set by hand."""
ON_OUTLINE_M = 0.05
"""What is said of a line is said of an edge whose middle is this near to it; set by hand."""


@dataclass(frozen=True)
class WallEdge:
    """A straight edge.

    Attributes
    ----------
    xy : (n, 2) float64, world metres: its vertices in the direction of the outline, the outside on the right
    party : another unit's outline touches it
    """

    xy: FloatArray
    party: bool

    @cached_property
    def start(self) -> FloatArray:
        return self.xy[0]

    @cached_property
    def length(self) -> float:
        return float(np.hypot(*(self.xy[-1] - self.xy[0])))

    @cached_property
    def along(self) -> FloatArray:
        """(2,) unit vector."""
        return np.asarray((self.xy[-1] - self.xy[0]) / self.length)

    @cached_property
    def outward(self) -> FloatArray:
        """(2,) unit vector, square to the edge."""
        x, y = self.along
        return np.array([y, -x])

    @cached_property
    def line(self) -> LineString:
        return LineString(self.xy)


def outward_rings(outline: Polygon) -> list[FloatArray]:
    """(n, 2) vertices of each ring without the repeated last one, the outside of the building on the right."""
    rings = []
    for number, ring in enumerate((outline.exterior, *outline.interiors)):
        xy = shapely.get_coordinates(ring)[:-1]
        rings.append(xy if ring.is_ccw == (number == 0) else xy[::-1])
    return rings


def wall_edges(outline: Polygon, party: Sequence[LineString]) -> list[WallEdge]:
    """All straight edges of an outline, ring after ring."""
    return [edge for ring in wall_rings(outline, party) for edge in ring]


@remembered
def wall_rings(outline: Polygon, party: Sequence[LineString]) -> list[list[WallEdge]]:
    """The straight edges of each ring of an outline, the exterior first."""
    shared = shapely.union_all(list(party)) if party else None
    return [_edges_of(ring, shared) for ring in outward_rings(outline)]


def _edges_of(ring: FloatArray, shared: shapely.Geometry | None) -> list[WallEdge]:
    following = np.roll(ring, -1, axis=0)
    middles = shapely.points((ring + following) / 2)
    party = np.zeros(len(ring), bool)
    if shared is not None:
        ends = [shapely.dwithin(shapely.points(p), shared, ON_PARTY_M) for p in (ring, following)]
        party = shapely.dwithin(middles, shared, ON_PARTY_M) & ends[0] & ends[1]
    first = next((k for k in range(len(ring)) if _turns(ring, party, k)), 0)
    order = [(first + k) % len(ring) for k in range(len(ring))]
    groups: list[list[int]] = []
    for k in order:
        if groups and not _turns(ring, party, k) and _is_straight([*ring[groups[-1]], ring[k], following[k]]):
            groups[-1].append(k)
        else:
            groups.append([k])
    return [WallEdge(np.vstack([ring[g], following[g[-1]]]), bool(party[g[0]])) for g in groups]


def _turns(ring: FloatArray, party: BoolArray, k: int) -> bool:
    """Whether a new edge begins at a vertex."""
    if party[k] != party[k - 1]:
        return True
    before, after = ring[k] - ring[k - 1], ring[(k + 1) % len(ring)] - ring[k]
    turn = np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after)
    return bool(abs(turn) > np.radians(STRAIGHT_DEG))


def _is_straight(points: Sequence[FloatArray]) -> bool:
    xy = np.asarray(points)
    chord = xy[-1] - xy[0]
    length = float(np.hypot(*chord))
    if length == 0:
        return False
    off = (xy - xy[0]) @ np.array([chord[1], -chord[0]]) / length
    return bool(np.abs(off).max() <= STRAIGHT_M)


def known_part(edge: WallEdge, known: Sequence[OutlineEdge]) -> OutlineEdge | None:
    """What is said of the part of the outline that the edge lies on."""
    middle = shapely.Point((edge.xy[0] + edge.xy[-1]) / 2)
    near = [(float(shapely.distance(e.line, middle)), k) for k, e in enumerate(known)]
    return known[min(near)[1]] if near and min(near)[0] <= ON_OUTLINE_M else None
