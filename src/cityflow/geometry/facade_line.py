"""The line of a façade beside a straight edge, fitted to points of images or to laser echoes."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.facade_points import WallPoints
from cityflow.geometry.straight_edges import WallEdge

INSIDE_M, OUTSIDE_M = 2.0, 0.6
"""Façade points are looked for so far on both sides of an edge; what stands outside is soon another building's; set by hand."""
TURN_DEG = 25.0
"""Points whose normals turn farther off the edge's are of another wall; set by hand, as are those below."""
BELOW_ROOF_M = 0.3
"""Higher points are dragged towards the rim by the matching of the roof."""
STEP_M, HALF_M, TRIM_M = 0.05, 0.12, 0.15
"""Spacing of the places across an edge, half the width that counts for one, and what a line is fitted to."""
CELL_M = 0.5
"""Points are counted by cells of the façade: a window frame of a thousand points is no better than the wall around it."""
LEAST_POINTS, LEAST_SHARE, LEAST_RISE_M = 30, 0.4, 1.0
"""Points, share of the edge and height that a façade needs,"""
LEAST_ECHOES = 8
"""and points where only heights are known."""
MIDDLE, LEAST_UPRIGHT = 0.2, 0.5
"""Of the points a tenth at either end says nothing of how high they reach; about their trend along the edge a façade's fill half of the least height. A roof
of 50° fills 0.36 m of `TRIM_M` to either side."""
APART_M, MOST_RIVAL = 0.3, 0.75
"""Two places so far apart, the weaker with more than this share of the other's cells: the points do not tell which is the wall."""
ALIKE_POINTS = 10.0
"""So many neighbouring points err together."""


def facade_place(edge: WallEdge, walls: WallPoints, roof_m: float, least_sigma_m: float) -> tuple[float, float] | None:
    """How far outside an edge its façade stands by the points on it, and with what standard deviation; None where they do not tell.

    The line parallel to the edge beside which most of the façade has points; these may be anywhere within `INSIDE_M`.
    """
    if len(walls) == 0:
        return None
    offset = walls.xyz[:, :2] - edge.start
    s, t, z = offset @ edge.along, offset @ edge.outward, walls.xyz[:, 2]
    own = (s > 0) & (s < edge.length) & (t > -INSIDE_M) & (t < OUTSIDE_M)
    own &= walls.normal.astype(np.float64) @ edge.outward > np.cos(np.radians(TURN_DEG))
    if np.isfinite(roof_m):
        own &= z < roof_m - BELOW_ROOF_M
    if np.count_nonzero(own) < LEAST_POINTS:
        return None
    return _line_of(
        np.stack([s[own], t[own], z[own]]), edge.length, least_sigma_m, LEAST_POINTS, ALIKE_POINTS, LEAST_RISE_M
    )


def laser_place(
    edge: WallEdge, xyz: FloatArray, roof_m: float, least_sigma_m: float, least_rise_m: float = LEAST_RISE_M
) -> tuple[float, float] | None:
    """The same by echoes, (N, 3) world, that no image has given a direction: those well below the roof, along one upright line; each errs by itself."""
    offset = xyz[:, :2] - edge.start
    s, t, z = offset @ edge.along, offset @ edge.outward, xyz[:, 2]
    own = (s > 0) & (s < edge.length) & (t > -INSIDE_M) & (t < OUTSIDE_M) & (z < roof_m - BELOW_ROOF_M)
    if np.count_nonzero(own) < LEAST_ECHOES:
        return None
    return _line_of(np.stack([s[own], t[own], z[own]]), edge.length, least_sigma_m, LEAST_ECHOES, 1.0, least_rise_m)


def _line_of(
    stz: FloatArray, length: float, least_sigma_m: float, least: int, alike: float, least_rise: float
) -> tuple[float, float] | None:
    """Along, across and height of points (3, n); how many there have to be, how many err together, and over what height they have to be."""
    s, t, z = stz
    column, row = np.floor(s / CELL_M).astype(np.int64), np.floor((z - z.min()) / CELL_M).astype(np.int64)
    cell = column * (int(row.max()) + 1) + row
    places = np.arange(-INSIDE_M, OUTSIDE_M + STEP_M / 2, STEP_M)
    support = _cells_near(cell, t, places)
    best = int(np.argmax(support))
    place = float(np.median(t[np.abs(t - places[best]) < HALF_M]))
    on = np.abs(t - place) < TRIM_M
    columns = max(1, int(length / CELL_M))
    rise = len(np.unique(row[on])) * CELL_M
    seen = len(np.unique(np.minimum(column[on], columns - 1))) / columns
    rival = int(support[np.abs(places - place) > APART_M].max(initial=0))
    count = int(np.count_nonzero(on))
    if count < least or seen < LEAST_SHARE or rise < least_rise or rival > MOST_RIVAL * support[best]:
        return None
    if _height_of(s[on], z[on]) < LEAST_UPRIGHT * least_rise:
        return None
    place = float(np.median(t[on]))
    spread = 1.4826 * float(np.median(np.abs(t[on] - place)))
    return place, float(np.hypot(1.25 * spread / np.sqrt(count / alike), least_sigma_m))


def _height_of(s: FloatArray, z: FloatArray) -> float:
    """How high the strip is that points fill about their trend along an edge, metres: a roof that slopes along it or away from it fills none."""
    if len(z) < 2 or np.ptp(s) <= 0:
        return 0.0
    off = z - np.polyval(np.polyfit(s, z, 1), s)
    low, high = np.quantile(off, [MIDDLE / 2, 1 - MIDDLE / 2])
    return float(high - low) / (1 - MIDDLE)


def _cells_near(cell: IntArray, t: FloatArray, places: FloatArray) -> IntArray:
    """(P,) how many cells have a point within `HALF_M` of each place across the edge."""
    order = np.argsort(cell, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(cell[order]) != 0])
    near = np.abs(t[order] - places[:, None]) < HALF_M
    return np.asarray(np.logical_or.reduceat(near, starts, axis=1).sum(axis=1))
