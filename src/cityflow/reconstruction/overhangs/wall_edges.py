"""The straight edges of an outline, which of them touch a neighbour, and the roof plane beside every place of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic

STRAIGHT_DEG = 2.0
"""Pieces of an outline that turn less than this are one edge, as long as their ends stay `STRAIGHT_M` near its line."""
STRAIGHT_M = 0.03
ON_PARTY_M = 0.01
BESIDE_M = 0.02
"""The roof beside a wall is the one this far inside."""


@dataclass(frozen=True, slots=True)
class WallEdge:
    """A straight edge.

    Attributes
    ----------
    xy : (n, 2) float64, world metres: its vertices in the direction of the outline, the outside on the right
    party : another unit's outline touches it
    """

    xy: FloatArray
    party: bool

    @property
    def start(self) -> FloatArray:
        return self.xy[0]

    @property
    def length(self) -> float:
        return float(np.hypot(*(self.xy[-1] - self.xy[0])))

    @property
    def along(self) -> FloatArray:
        """(2,) unit vector."""
        return np.asarray((self.xy[-1] - self.xy[0]) / self.length)

    @property
    def outward(self) -> FloatArray:
        """(2,) unit vector, square to the edge."""
        x, y = self.along
        return np.array([y, -x])

    @property
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
    shared = shapely.union_all(list(party)) if party else None
    return [edge for ring in outward_rings(outline) for edge in _edges_of(ring, shared)]


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


def face_planes(solid: Polyhedron, origin: FloatArray) -> tuple[list[Polygon], FloatArray]:
    """Roof faces in plan and (F, 3) a, b, c of z = a·x + b·y + c; both local to `origin` (3,), metres."""
    polygons, planes = [], []
    for face in solid.of_semantic(Semantic.ROOF):
        rings = [solid.ring(r) - origin for r in face.rings]
        shell, *holes = (r[:, :2] for r in rings)
        points = np.concatenate(rings)
        middle = points.mean(axis=0)
        near = points - middle
        a, b = np.linalg.lstsq(near[:, :2], near[:, 2], rcond=None)[0]
        polygons.append(Polygon(shell, holes))
        planes.append((a, b, middle[2] - a * middle[0] - b * middle[1]))
    return polygons, np.asarray(planes, np.float64).reshape(-1, 3)


def faces_beside(polygons: Sequence[Polygon], xy: FloatArray) -> IntArray:
    """(N,) the face that each place (N, 2) lies in, or the nearest one; -1 where there is none."""
    if not polygons:
        return np.full(len(xy), -1)
    found = np.full(len(xy), -1)
    for number, polygon in enumerate(polygons):
        inside = (found < 0) & shapely.contains_xy(polygon, xy[:, 0], xy[:, 1])
        found[inside] = number
    lost = np.flatnonzero(found < 0)
    if len(lost):
        found[lost] = shapely.STRtree(list(polygons)).nearest(shapely.points(xy[lost]))
    return found
