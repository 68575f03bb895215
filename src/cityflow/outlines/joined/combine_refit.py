"""Refits edges of a footprint to all their walls, and corners to the intersections of these lines."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.outlines.from_heights.refit import edge_directions, intersected
from cityflow.outlines.from_walls.wall_line import WallLine

_ASIDE_M = 0.35
"""An edge moves onto walls no farther from it; set by hand on synthetic towns, as are those below."""
_PARALLEL_COS = np.cos(np.radians(8.0))
"""And turned no more."""
_SPACING_M = 0.25
"""Points of a wall that an edge is fitted to stand so far apart."""
_FLOOR_M = 0.02
"""No wall is known better than this."""
_TURN_SHARE, _TURN_M = 0.4, 2.0
"""An edge turns into its walls where they were seen along so much of it; else it only moves."""


def on_walls(polygon: Polygon, walls: Sequence[WallLine]) -> Polygon:
    """The polygon with its edges on the walls they belong to; as it was where that spoils it.

    Parameters
    ----------
    polygon : valid, exterior counter-clockwise, metres
    walls : in the same frame
    """
    if not walls:
        return polygon
    ends = np.array([(p, q) for w in walls for p, q in pairwise(shapely.get_coordinates(w.line)[:, :2])])
    sigma = np.array([w.sigma_m for w in walls for _ in range(len(w.line.coords) - 1)])
    tree = shapely.STRtree(shapely.linestrings(ends))
    rings = [
        _refitted(shapely.get_coordinates(r)[:-1], ends, sigma, tree) for r in (polygon.exterior, *polygon.interiors)
    ]
    moved = Polygon(rings[0], rings[1:])
    return moved if moved.is_valid and not moved.is_empty else polygon


def _refitted(ring: FloatArray, ends: FloatArray, sigma: FloatArray, tree: shapely.STRtree) -> FloatArray:
    following = np.roll(ring, -1, axis=0)
    anchor, direction = (ring + following) / 2, edge_directions(ring)
    for k, (a, b) in enumerate(zip(ring, following, strict=True)):
        numbers = np.sort(tree.query(LineString([a, b]), predicate="dwithin", distance=_ASIDE_M))
        points, weight = _samples(a, b, ends[numbers], sigma[numbers])
        if len(points):
            anchor[k], direction[k] = _line(points, weight, (a, b), float(direction[k]))
    result = intersected(anchor, direction, ring)
    # A corner that flies off is one of two lines that hardly cross: it was better known before.
    far = np.hypot(*(result - ring).T) > 2 * _ASIDE_M
    return np.where(far[:, None], ring, result)


def _samples(a: FloatArray, b: FloatArray, ends: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points on those walls that run along the edge from a to b, within its length, and their weights."""
    length = max(float(np.hypot(*(b - a))), 1e-9)
    d = (b - a) / length
    points, weights = [np.empty((0, 2))], [np.empty(0)]
    for (p, q), s in zip(ends, sigma, strict=True):
        reach = max(float(np.hypot(*(q - p))), 1e-9)
        if (q - p) @ d < _PARALLEL_COS * reach:
            continue
        t = (np.arange(int(reach / _SPACING_M) + 1) + 0.5) / (int(reach / _SPACING_M) + 1)
        xy = p + t[:, None] * (q - p)
        along, aside = (xy - a) @ d, (xy - a) @ np.array([d[1], -d[0]])
        xy = xy[(along > 0) & (along < length) & (np.abs(aside) < _ASIDE_M)]
        points.append(xy)
        weights.append(np.full(len(xy), 1 / (_FLOOR_M**2 + float(np.nan_to_num(s, nan=0.1)) ** 2)))
    return np.concatenate(points), np.concatenate(weights)


def _line(
    points: FloatArray, weight: FloatArray, edge: tuple[FloatArray, FloatArray], direction: float
) -> tuple[FloatArray, float]:
    """A point and the direction (radians) of the line through weighted points."""
    a, b = edge
    centre = weight @ points / weight.sum()
    length = float(np.hypot(*(b - a)))
    d = np.array([np.cos(direction), np.sin(direction)])
    along = (points - a) @ d
    if np.ptp(along) < max(_TURN_M, _TURN_SHARE * length):
        return centre, direction
    off = points - centre
    xx, yy, xy = (
        (weight * off[:, 0] ** 2).sum(),
        (weight * off[:, 1] ** 2).sum(),
        (weight * off[:, 0] * off[:, 1]).sum(),
    )
    turned = 0.5 * np.arctan2(2 * xy, xx - yy)
    return centre, turned if np.cos(turned - direction) > 0 else turned + np.pi
