"""Where borders of a strip may be: maxima of what changes along it."""

from __future__ import annotations

import numpy as np
from shapely import Point, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.border_position import REACH_M
from cityflow.splitting.cuts.cut_places import place
from cityflow.splitting.scores.border_sides import Sides
from cityflow.splitting.scores.score import score
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.strip_evidence import StripEvidence
from cityflow.splitting.strips.strip_rasters import CONTEXT_M

APART_M = 1.2
"""Maxima nearer to one another than this are one."""
FREE_END_M = 2.0
"""No border is nearer to a free end of a row."""
LEAST_SCORE = 0.6
"""Weaker maxima of the scan are no proposals."""
SAME_M = 0.9
"""Places nearer than this are one, of which the clearer counts."""
BEYOND_M = 1.0


def proposals(evidence: StripEvidence, free: tuple[bool, bool]) -> list[float]:
    """Places of the maxima of the scan, ascending; the ends of the strip too where another wing begins.

    Parameters
    ----------
    free : whether nothing goes on beyond the first and the last chord
    """
    scores = score(evidence)
    total = scores.total.copy()
    for end in (0, -1):
        if free[end]:
            total[np.abs(evidence.stations - evidence.stations[end]) < FREE_END_M] = -np.inf
    found = [k for k in maxima(total, evidence.stations, APART_M) if total[k] > LEAST_SCORE]
    places: list[float] = []
    for k in sorted(found, key=lambda k: (-total[k], k)):
        u = place(evidence, scores, k)
        if all(abs(u - p) >= SAME_M for p in places):
            places.append(u)
    ends = [float(evidence.stations[k]) for k in (0, -1) if np.isfinite(total[k])]
    near = [min((abs(p - e) for p in places), default=np.inf) for e in ends]
    return sorted([*places, *(e for e, off in zip(ends, near, strict=True) if off >= SAME_M)])


def reach(strip: AxisStrip, free: tuple[bool, bool]) -> Sides:
    """How far one may look at all: beyond an end only where another wing begins."""
    first, last = (0.0 if end else CONTEXT_M for end in free)
    return Sides(float(strip.stations[0]) - first, float(strip.stations[-1]) + last)


def free_ends(strip: AxisStrip, part: Polygon) -> tuple[bool, bool]:
    """Whether nothing of the outline goes on beyond the first and the last chord."""
    free = []
    for end, outward in ((0, -BEYOND_M), (-1, BEYOND_M)):
        middle = float(strip.low[end] + strip.high[end]) / 2
        free.append(not part.contains(Point(strip.to_world(np.array([strip.stations[end] + outward, middle])))))
    return free[0], free[1]


def maxima(values: FloatArray, stations: FloatArray, apart: float) -> list[int]:
    """Stations whose value is the highest within `apart` metres, strongest first; of a plateau the middle."""
    order = np.argsort(-values, kind="stable")
    free = np.isfinite(values)
    found: list[int] = []
    for k in order:
        if not free[k]:
            continue
        near = np.abs(stations - stations[k]) < apart
        top = near & (values > values[k] - 0.25) & (np.abs(stations - stations[k]) < REACH_M)
        found.append(int(np.median(np.flatnonzero(top))))
        free &= ~near
    return found
