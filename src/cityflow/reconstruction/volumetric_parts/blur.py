"""Surfaces that matching made: where heights jump, image matching draws a slope between them.

Along a party wall the rim of a roof leans towards the neighbour's; such strips are taken for unseen and filled by the large
surfaces beside them. Within an outline the slope stands where a wall rises from a lower roof; its points are dropped, and the wall
takes its place.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.reconstruction.planes.plane_segments import UNASSIGNED

FILL_M = 2.0
"""Surfaces with points nearer than this may fill a strip; set by hand, as are those below."""
LARGE = 0.3
"""Only surfaces with this share of the largest one's points fill strips: dormers do not."""
BESIDE_M = 0.8
"""Other surfaces are sought so far above and below a slope."""


def without_strips(
    points: FloatArray, labels: IntArray, planes: FloatArray, party: shapely.Geometry, reach: float
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Points, labels and planes less surfaces that lie along a party wall only; their points go to the surfaces beside.

    Parameters
    ----------
    points : (N, 3) local;  labels : (N,);  planes : (P, 3) a, b, c of z = a·x + b·y + c
    party : lines in plan, local
    reach : metres from a party wall within which most of such a surface lies
    """
    away = shapely.distance(shapely.points(points[:, :2]), party)
    far = [float(np.percentile(away[labels == k], 80)) if np.any(labels == k) else 0.0 for k in range(len(planes))]
    kept = np.array(far) > reach
    if kept.all() or not kept.any():  # also where there are no planes at all
        return points, labels, planes
    strip = (labels >= 0) & ~kept[labels]
    count = np.bincount(labels[labels >= 0], minlength=len(planes))
    large = np.flatnonzero(kept & (count >= LARGE * count[kept].max()))
    lowest, owner = np.full(np.count_nonzero(strip), np.inf), np.full(np.count_nonzero(strip), UNASSIGNED)
    xy = points[strip, :2]
    for k in large:
        near = cKDTree(points[labels == k, :2]).query(xy, distance_upper_bound=FILL_M)[0] < FILL_M
        z = xy @ planes[k, :2] + planes[k, 2]
        lower = near & (z < lowest)
        lowest[lower], owner[lower] = z[lower], k
    points, labels = points.copy(), labels.copy()
    points[strip, 2] = np.where(owner >= 0, lowest, points[strip, 2])
    labels[strip] = owner
    return points, *_compressed(labels, planes, kept)


def without_ramps(
    points: FloatArray, labels: IntArray, planes: FloatArray, width: float, slope_deg: float
) -> tuple[BoolArray, IntArray, FloatArray]:
    """Which points stay, and labels and planes less steep narrow surfaces with other ones above and below them.

    Parameters
    ----------
    width : metres, in plan and along the slope, below which a surface is narrow
    slope_deg : degrees, above which it is steep
    """
    kept = np.ones(len(planes), bool)
    if len(planes) == 0:
        return np.ones(len(points), bool), labels, planes
    steep = np.hypot(planes[:, 0], planes[:, 1]) > math.tan(math.radians(slope_deg))
    for k in np.flatnonzero(steep):
        kept[k] = not _is_ramp(points, labels, planes[k], int(k), width)
    stays = (labels < 0) | kept[labels]
    return stays, *_compressed(labels, planes, kept)


def _is_ramp(points: FloatArray, labels: IntArray, plane: FloatArray, k: int, width: float) -> bool:
    own = points[labels == k, :2]
    if len(own) < 3:
        return False
    down = -plane[:2] / np.hypot(*plane[:2])
    across = np.array([-down[1], down[0]])
    t, s = own @ down, own @ across
    low, high = np.percentile(t, (3, 97))
    if high - low > width:
        return False
    other = points[(labels >= 0) & (labels != k)]
    u, v = other[:, :2] @ down, other[:, :2] @ across
    beside = (v > np.percentile(s, 3)) & (v < np.percentile(s, 97))
    below = beside & (u > high - 0.1) & (u < high + BESIDE_M)
    above = beside & (u < low + 0.1) & (u > low - BESIDE_M)
    length = float(np.ptp(np.percentile(s, (3, 97))))
    if min(_covered(v[below]), _covered(v[above])) < 0.6 * length:
        return False
    # A step: what is above stands higher than what is below by most of the slope's own fall.
    fall = (high - low) * float(np.hypot(*plane[:2]))
    return bool(np.median(other[above, 2]) - np.median(other[below, 2]) > 0.6 * fall)


def _covered(along: FloatArray) -> float:
    """Metres along a line that points stand over, in steps of 0.5 m."""
    return 0.5 * len(np.unique(np.floor(along / 0.5)))


def _compressed(labels: IntArray, planes: FloatArray, kept: BoolArray) -> tuple[IntArray, FloatArray]:
    number = np.full(len(planes) + 1, UNASSIGNED)
    number[:-1][kept] = np.arange(np.count_nonzero(kept))
    return number[labels], planes[kept]
