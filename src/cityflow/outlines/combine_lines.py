"""Lines that may border a building: walls and how they go on, edges of its roof, and steps at the ends of walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.outlines.wall_line import CURVE, WallLine

_PARALLEL_SIN = np.sin(np.radians(10.0))
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


@dataclass(frozen=True, slots=True)
class Pieces:
    """Straight pieces of candidate lines.

    Attributes
    ----------
    ends : (n, 2, 2) float64, metres in the frame of the problem; the building, if any, on the left
    kind : (n,) of `Kind`
    wall : (n,) index of the wall, -1 for roofs and steps
    """

    ends: FloatArray
    kind: IntArray
    wall: IntArray

    def of(self, *kinds: Kind) -> BoolArray:
        return np.isin(self.kind, kinds)


def candidate_pieces(walls: Sequence[WallLine], roofs: Sequence[Polygon], reach_m: float, beyond_m: float) -> Pieces:
    """All candidates of one problem.

    Parameters
    ----------
    walls : in the frame of the problem
    roofs : outlines of the roof, however found
    reach_m : an edge of the roof at most so far before a wall is its eave
    beyond_m : every wall may go on so far at both ends
    """
    rows: list[tuple[FloatArray, Kind, int]] = []
    edges = np.concatenate([np.empty((0, 2, 2)), *(_edges(roof) for roof in roofs)])
    for number, wall in enumerate(walls):
        rows += [(piece, kind, number) for piece, kind in _wall_pieces(wall, edges, reach_m, beyond_m)]
        rows += [(piece, Kind.STEP, -1) for piece in _steps(wall)]
    for edge in edges:
        d = _unit(edge[1] - edge[0]) * _ROOF_END_M
        rows.append((edge, Kind.ROOF, -1))
        rows.append((np.stack([edge[0] - d, edge[0]]), Kind.ROOF_EXTENDED, -1))
        rows.append((np.stack([edge[1], edge[1] + d]), Kind.ROOF_EXTENDED, -1))
    if not rows:
        return Pieces(np.empty((0, 2, 2)), np.empty(0, np.int64), np.empty(0, np.int64))
    return Pieces(
        np.stack([r[0] for r in rows]), np.array([r[1] for r in rows], np.int64), np.array([r[2] for r in rows])
    )


def _edges(polygon: Polygon) -> FloatArray:
    """(n, 2, 2) edges of all rings, the inside on the left."""
    rings = [shapely.get_coordinates(r) for r in (polygon.exterior, *polygon.interiors)]
    return np.concatenate([np.stack([r[:-1], r[1:]], axis=1) for r in rings])


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / max(float(np.hypot(*vector)), 1e-12))


def _wall_pieces(wall: WallLine, edges: FloatArray, reach_m: float, beyond_m: float) -> list[tuple[FloatArray, Kind]]:
    """The wall as seen, what follows from the eaves before it, and beyond."""
    xy = shapely.get_coordinates(wall.line)
    result = [(np.stack([p, q]), Kind.SEEN) for p, q in pairwise(xy)]
    along_roof = (0.0, 0.0) if wall.kind == CURVE else _along_roof(xy, edges, reach_m)
    for tip, d, along in (
        (xy[0], _unit(xy[0] - xy[1]), along_roof[0]),
        (xy[-1], _unit(xy[-1] - xy[-2]), along_roof[1]),
    ):
        middle = tip + d * along
        far = middle + d * (beyond_m if along == 0 else min(beyond_m, _ROOF_END_M))
        outwards = tip is xy[-1]
        if along > 0:
            result.append((np.stack([tip, middle] if outwards else [middle, tip]), Kind.ALONG_ROOF))
        result.append((np.stack([middle, far] if outwards else [far, middle]), Kind.EXTENDED))
    return result


def _along_roof(xy: FloatArray, edges: FloatArray, reach_m: float) -> tuple[float, float]:
    """How far the eaves before a straight wall reach beyond its first and its last end, metres."""
    d = _unit(xy[-1] - xy[0])
    out = np.array([d[1], -d[0]])
    length = float(np.hypot(*(xy[-1] - xy[0])))
    before = after = 0.0
    for a, b in edges:
        e = b - a
        if abs(e[0] * d[1] - e[1] * d[0]) > _PARALLEL_SIN * np.hypot(*e) or e @ d <= 0:
            continue
        s, t = (a - xy[0]) @ d, (b - xy[0]) @ d
        away = ((a + b) / 2 - xy[0]) @ out
        if -0.6 <= away <= reach_m and min(t, length) - max(s, 0.0) > 0.5:
            before, after = max(before, -s), max(after, t - length)
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
