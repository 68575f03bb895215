"""Candidate borders of a building: walls and their extensions, edges of its roof, steps at the ends of walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.outlines.from_walls.wall_line import CURVE, WallLine
from cityflow.outlines.joined.combine_wall_bases import KnownWall

_PARALLEL_SIN = np.sin(np.radians(10.0))
"""Lines that turn less are parallel; set by hand on synthetic towns, as are those below."""
_ASTRAY_M = 0.25
"""A wall follows its eaves no farther than it stays parallel to them within so much: a smaller step in a wall is straightened."""
_SAME_BASE_M = 0.5
"""A wall whose base changes by more is two."""
_GAPS_M = 0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.2
"""Widths of gaps that are tried before a wall."""
_GAP_END_M = 1.5
"""The other side of a gap goes on so far beyond both ends."""
_BELOW_EAVE_M = 1.5
"""What is before a wall and lower than its top by more is no eaves of its own."""
_NEAR_END_M = 1.0
"""The first metre beyond the end of a wall, where it is likelier to go on than farther out."""
_ROOF_END_M = 2.5
"""A roof's edge goes on so far: a wall stands behind it and meets the next one there."""


class Kind(IntEnum):
    """How a piece of a line is known, the surest first."""

    SEEN = 0
    ALONG_ROOF = 1
    EXTENDED = 2
    ROOF = 3
    ROOF_EXTENDED = 4
    STEP = 5
    GAP = 6
    PART = 7
    NEAR_END = 8


@dataclass(frozen=True, slots=True)
class Pieces:
    """Straight pieces of candidate lines.

    Attributes
    ----------
    ends : (n, 2, 2) float64, metres in the frame of the problem; the building, if any, on the left
    kind : (n,) of `Kind`
    base : (n,) metres above the terrain down to which the wall was seen; NaN where that is not known
    wall : (n,) index of the wall, -1 for roofs, steps and gaps
    """

    ends: FloatArray
    kind: IntArray
    base: FloatArray
    wall: IntArray

    def of(self, *kinds: Kind) -> BoolArray:
        return np.isin(self.kind, kinds)


@dataclass(frozen=True, slots=True)
class Roofs:
    """Outlines of a region's roof, the best first, and of its parts where narrow gaps nearly divide it."""

    whole: tuple[Polygon, ...] = ()
    parts: tuple[Polygon, ...] = ()

    def moved(self, by: FloatArray) -> Roofs:
        return Roofs(
            tuple(shapely.transform(p, lambda xy: xy + by) for p in self.whole),
            tuple(shapely.transform(p, lambda xy: xy + by) for p in self.parts),
        )


_Row = tuple[FloatArray, Kind, float, int]


def candidate_pieces(
    walls: Sequence[KnownWall], roofs: Roofs, reach_m: float, beyond_m: float, enclosed: BoolArray
) -> Pieces:
    """All candidates of one problem.

    Parameters
    ----------
    walls : in the frame of the problem
    roofs : outlines of the region's roof
    reach_m : an edge of the roof at most so far before a wall is its eave
    beyond_m : every wall may go on so far at both ends
    enclosed : (walls,) True for walls that look at a narrow gap: on its other side something stands again
    """
    rows: list[_Row] = []
    edges = np.concatenate([np.empty((0, 2, 2)), *(_edges(roof) for roof in (*roofs.whole, *roofs.parts))])
    of_whole = sum(shapely.get_num_coordinates(r) - shapely.get_num_interior_rings(r) - 1 for r in roofs.whole)
    for number, known in enumerate(walls):
        rows += [(piece, kind, base, number) for piece, kind, base in _wall_pieces(known, edges, reach_m, beyond_m)]
        rows += [(piece, Kind.STEP, np.nan, -1) for piece in _steps(known.wall)]
        if enclosed[number]:
            rows += [(piece, Kind.GAP, np.nan, -1) for piece in _across_gap(known.wall)]
    for place, edge in enumerate(edges):
        d = _unit(edge[1] - edge[0]) * _ROOF_END_M
        rows.append((edge, Kind.ROOF if place < of_whole else Kind.PART, np.nan, -1))
        rows.append((np.stack([edge[0] - d, edge[0]]), Kind.ROOF_EXTENDED, np.nan, -1))
        rows.append((np.stack([edge[1], edge[1] + d]), Kind.ROOF_EXTENDED, np.nan, -1))
    ends = np.array([r[0] for r in rows]).reshape(-1, 2, 2)
    kinds, numbers = np.array([r[1] for r in rows], np.int64), np.array([r[3] for r in rows], np.int64)
    return Pieces(ends, kinds, np.array([r[2] for r in rows], np.float64), numbers)


def _edges(polygon: Polygon) -> FloatArray:
    """(n, 2, 2) edges of all rings, the inside on the left."""
    rings = [shapely.get_coordinates(r) for r in (polygon.exterior, *polygon.interiors)]
    return np.concatenate([np.stack([r[:-1], r[1:]], axis=1) for r in rings])


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / max(float(np.hypot(*vector)), 1e-12))


def _wall_pieces(
    known: KnownWall, edges: FloatArray, reach_m: float, beyond_m: float
) -> list[tuple[FloatArray, Kind, float]]:
    """The wall as seen, what follows from the eaves before it, and beyond."""
    wall = known.wall
    xy = shapely.get_coordinates(wall.line)
    result = [(piece, Kind.SEEN, base) for piece, base in _sections(known)]
    along_roof = (0.0, 0.0) if wall.kind == CURVE else _along_roof(xy, edges, reach_m)
    for last in (False, True):
        tip, d = (xy[-1], _unit(xy[-1] - xy[-2])) if last else (xy[0], _unit(xy[0] - xy[1]))
        along, base = along_roof[int(last)], _eave_base(wall)
        middle = tip + d * along
        far = middle + d * (beyond_m if along == 0 else min(beyond_m, _ROOF_END_M))
        if along > 0:
            result.append((np.stack([tip, middle] if last else [middle, tip]), Kind.ALONG_ROOF, base))
        near = middle + d * _NEAR_END_M
        result.append((np.stack([middle, near] if last else [near, middle]), Kind.NEAR_END, base))
        result.append((np.stack([near, far] if last else [far, near]), Kind.EXTENDED, base))
    return result


def _eave_base(wall: WallLine) -> float:
    """Height above the terrain that only the wall's own eaves surpass, not a lower roof before it."""
    return wall.z_high - wall.ground_z - _BELOW_EAVE_M


def _sections(known: KnownWall) -> list[tuple[FloatArray, float]]:
    """Straight pieces of a wall, cut where its base changes."""
    line, bases = known.wall.line, known.bases
    change = np.flatnonzero(~(np.abs(np.diff(bases)) < _SAME_BASE_M) & np.isfinite(bases[1:])) + 1
    vertices = shapely.line_locate_point(line, shapely.points(shapely.get_coordinates(line))) / line.length
    vertices[-1] = 1.0
    cuts = np.unique(np.concatenate([vertices, change / len(bases)]))
    xy = shapely.get_coordinates(shapely.line_interpolate_point(line, cuts, normalized=True))
    number = np.minimum(((cuts[1:] + cuts[:-1]) / 2 * len(bases)).astype(int), len(bases) - 1)
    return [(np.stack([p, q]), float(bases[k])) for p, q, k in zip(xy[:-1], xy[1:], number, strict=True)]


def _across_gap(wall: WallLine) -> list[FloatArray]:
    """Lines before a wall where the other side of a gap may be."""
    xy = shapely.get_coordinates(wall.line)[[0, -1]]
    d = _unit(xy[1] - xy[0])
    n = np.array([d[1], -d[0]])
    # The other side's inside lies beyond the gap: these run the other way.
    return [np.stack([xy[1] + d * _GAP_END_M + n * t, xy[0] - d * _GAP_END_M + n * t]) for t in _GAPS_M]


def _along_roof(xy: FloatArray, edges: FloatArray, reach_m: float) -> tuple[float, float]:
    """How far the eaves before a straight wall reach beyond its first and its last end, metres: as far as it runs along them.

    A short wall is seen with a direction of its own, some degrees off. Drawn along a long roof it would cut through its far end.
    """
    d = _unit(xy[-1] - xy[0])
    out = np.array([d[1], -d[0]])
    length = float(np.hypot(*(xy[-1] - xy[0])))
    before = after = 0.0
    for a, b in edges:
        e = b - a
        turn = abs(e[0] * d[1] - e[1] * d[0]) / np.hypot(*e)
        if turn > _PARALLEL_SIN or e @ d <= 0:
            continue
        s, t = (a - xy[0]) @ d, (b - xy[0]) @ d
        away = ((a + b) / 2 - xy[0]) @ out
        if -0.6 <= away <= reach_m and min(t, length) - max(s, 0.0) > 0.5:
            most = _ASTRAY_M / max(turn, 1e-9)
            before, after = max(before, min(-s, most)), max(after, min(t - length, most))
    return float(before), float(after)


def _steps(wall: WallLine, reach_m: float = 2.0) -> list[FloatArray]:
    """Lines across both ends of a wall: where the next wall stands before or behind this one."""
    xy = shapely.get_coordinates(wall.line)
    result = []
    for tip, other in ((xy[0], xy[1]), (xy[-1], xy[-2])):
        d = _unit(tip - other)
        n = np.array([-d[1], d[0]]) * reach_m
        result.append(np.stack([tip - n, tip + n]))
    return result
