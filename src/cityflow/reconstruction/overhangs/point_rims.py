"""How far roof points reach beyond a wall, where a surface model is too coarse to show a rim: LiDAR.

Points beyond the wall that lie on the roof's plane are taken as evenly spread between the wall and the rim, at the density of those
just inside; the rim then lies a little beyond the farthest of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.points import PointCloud, concatenate
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.straight_edges import WallEdge

INSIDE_M = 1.0
"""The density is that of the roof points this near to the wall; set by hand."""
LEAST_GAP_M = 0.25
"""Points of a roof that end in a wider gap end there; set by hand."""
GAP_SPACINGS = 6.0
"""Roof points end at a gap of so many mean spacings along the way out; set by hand."""
LEAST_FILLED = 0.5
"""Up to its rim a roof has at least this share of the points that it has inside; what is thinner stands there by chance: crowns, cables, a
neighbour's eave; set by hand."""
LEAST_POINTS, LEAST_BEYOND = 6, 3
"""Fewer points near an edge, or beyond the wall, tell no overhang; set by hand."""
BIN_M, BIN_POINTS = 0.5, 4
"""Shares are counted by pieces of the wall so long, or longer where there are too few points for that; set by hand."""
LEAST_SHARE = 0.6
"""Roof points stand beyond the wall along so much of it; those of a neighbour's eave stand at one end; set by hand."""


@dataclass(frozen=True, slots=True)
class PointRim:
    """The rim of an edge.

    Attributes
    ----------
    reach_m : metres beyond the edge, negative where the roof ends short of it, NaN where nothing tells
    sigma_m : its standard deviation
    seen : share of the edge with roof points beside it
    """

    reach_m: float
    sigma_m: float
    seen: float


NOT_SEEN = PointRim(float("nan"), float("nan"), 0.0)


def roofs_around(evidence: Evidence) -> PointCloud:
    """What stands in and around the outline and is of the classes that its roof is of: densities are compared within the same cloud."""
    if not len(evidence.around):
        return concatenate([evidence.points])
    if not len(evidence.points):
        return evidence.around
    return evidence.around.take(np.isin(evidence.around.classification, np.unique(evidence.points.classification)))


def point_rim(edge: WallEdge, heights: FloatArray, xyz: FloatArray, limits: tuple[float, float, float]) -> PointRim:
    """The rim of one edge by points.

    Parameters
    ----------
    heights : (N,) world height of the roof's plane at each point, as it goes on beyond this edge; metres
    xyz : (N, 3) world
    limits : farthest reach, how near to its plane a roof point lies, and standard deviation of a point in plan; metres
    """
    most, on_roof, sigma_m = limits
    offset = xyz[:, :2] - edge.start
    s, t = offset @ edge.along, offset @ edge.outward
    roof = (s > 0) & (s < edge.length) & (np.abs(xyz[:, 2] - heights) < on_roof)
    inside = roof & (t <= 0) & (t > -INSIDE_M)
    count = int(np.count_nonzero(inside))
    if count < LEAST_POINTS:
        return NOT_SEEN
    seen = _share_of_length(s[inside], edge.length)
    per_metre = count / INSIDE_M
    outside = np.flatnonzero(roof & (t > 0) & (t < most + LEAST_GAP_M))
    outside = outside[np.argsort(t[outside], kind="stable")]
    wide = np.flatnonzero(np.diff(t[outside], prepend=0.0) > max(LEAST_GAP_M, GAP_SPACINGS / per_metre))
    outside = outside[: wide[0]] if len(wide) else outside
    filled = np.flatnonzero(np.arange(1, len(outside) + 1) >= LEAST_FILLED * per_metre * t[outside])
    outside = outside[: filled[-1] + 1] if len(filled) else outside[:0]
    beyond = t[outside]
    if len(beyond) and beyond[-1] > most:
        return NOT_SEEN
    spacing = 1.0 / per_metre
    sigma = float(np.hypot(2.0 * spacing, sigma_m))
    if len(beyond) < LEAST_BEYOND or _share_of_length(s[outside], edge.length) < LEAST_SHARE:
        return PointRim(_ends_inside(t[inside], spacing), sigma, seen)
    # the last but one: a single stray point moves nothing
    n = len(beyond)
    return PointRim(float(beyond[-2] * (n + 1) / (n - 1)), sigma, seen)


def _ends_inside(t: FloatArray, spacing: float) -> float:
    """Where roof points end short of the edge, metres, negative; 0 where they reach it."""
    last = float(np.sort(t)[-2]) + spacing
    return last if last < -max(LEAST_GAP_M / 5, 2 * spacing) else 0.0


def _share_of_length(s: FloatArray, length: float) -> float:
    bins = max(3, min(int(length / BIN_M), len(s) // BIN_POINTS))
    hit = np.unique(np.clip((s / length * bins).astype(np.int64), 0, bins - 1))
    return len(hit) / bins
