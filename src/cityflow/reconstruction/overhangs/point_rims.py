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
from cityflow.reconstruction.overhangs.wall_edges import WallEdge

INSIDE_M = 1.0
"""The density is that of the roof points this near to the wall."""
LEAST_GAP_M = 0.25
GAP_SPACINGS = 6.0
"""Roof points end at a gap of so many mean spacings along the way out."""
LEAST_POINTS, LEAST_BEYOND = 6, 3
LEAST_SHARE = 0.6
"""Roof points stand beyond the wall along so much of it; those of a neighbour's eave stand at one end."""


@dataclass(frozen=True, slots=True)
class PointRim:
    """Metres beyond the wall, NaN where nothing tells; its standard deviation; share of the edge with roof points beside it."""

    reach_m: float
    sigma_m: float
    seen: float


NOT_SEEN = PointRim(float("nan"), float("nan"), 0.0)


def cloud_around(evidence: Evidence) -> PointCloud:
    """Roof points inside and whatever stands around, each once as far as that matters: densities are compared within the same cloud."""
    return evidence.around if len(evidence.around) else concatenate([evidence.points])


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
    beyond = t[outside]
    if len(beyond) and beyond[-1] > most:
        return NOT_SEEN
    spacing = 1.0 / per_metre
    sigma = float(np.hypot(2.0 * spacing, sigma_m))
    if len(beyond) < LEAST_BEYOND or _share_of_length(s[outside], edge.length) < LEAST_SHARE:
        return PointRim(0.0, sigma, seen)
    # the last but one: a single stray point moves nothing
    n = len(beyond)
    return PointRim(float(beyond[-2] * (n + 1) / (n - 1)), sigma, seen)


def _share_of_length(s: FloatArray, length: float) -> float:
    bins = max(3, int(length))
    hit = np.unique(np.clip((s / length * bins).astype(np.int64), 0, bins - 1))
    return len(hit) / bins
