"""Valleys and sharp steps across a row: what heights alone show of a border.

Where houses stand gable to the street, the gutters between their roofs are the borders, and nothing steps: row by row along the axis, a line is
fitted to the roof before a place and another to what comes after it; in a valley the roof opens upwards, and both lines meet near the place. One house
seldom has two gables side by side, and a dormer's valley is short.

Roofs of narrow houses change so much over a few metres that lines prolonged from there step everywhere. A step counts here if it is sharp, more than
slopes explain, and goes the same way along much of the depth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray

WINDOW_M, GUARD_M = 2.2, 0.3
FALLS = -0.15
"""Tangent: neither side may fall away from the bottom by more than this."""
LEAST_BEND, CLEAR_BEND = 0.45, 0.9
"""Difference of the tangents of both sides, at least; and from where on the valley is clear."""
MEET_M = 0.8
"""The two lines meet within this of the place."""
MAIN_M = 2.5
"""Rows lower than half of all by more than this are no part of the main roof."""
STRAIGHT_M = 0.12
"""A side is a plane if half of its cells are nearer to it."""
VALLEY_SHARE = (0.3, 0.55)
"""Share of the depth that the valley runs along: below the first it does not count, from the second on wholly."""
STEP_SHARE = (0.3, 0.55)
STEP_NEAR_M, STEP_FAR_M = 0.2, 0.8
LEAST_STEP_M = 0.3
LEAST_ROWS = 3


@dataclass(frozen=True, slots=True)
class RoofMarks:
    """(S,) each.

    Attributes
    ----------
    valley, step : how much each place is one, 0 to 1
    step_m : median height of the step over the rows that step, metres
    bottom : where along the row the valley's bottom lies; NaN where there is none
    """

    valley: FloatArray
    step: FloatArray
    step_m: FloatArray
    bottom: FloatArray

    @property
    def strength(self) -> FloatArray:
        """The stronger of both."""
        return np.maximum(self.valley, self.step)


def roof_marks(rows: FloatArray, u: FloatArray, places: FloatArray) -> RoofMarks:
    """What heights show at each place.

    Parameters
    ----------
    rows : (U, R) heights of a roof along the row, for R parts of its depth, metres; NaN unknown
    u : (U,) where the columns stand, evenly spaced by at most 0.3 m, metres
    places : (S,) to look at, metres
    """
    zero = np.zeros(len(places))
    found = RoofMarks(zero, zero.copy(), zero.copy(), np.full(len(places), np.nan))
    known = np.isfinite(rows).any(axis=0)
    if known.sum() < LEAST_ROWS or len(u) < 8:
        return found
    rows = rows[:, known]
    for k, place in enumerate(places.tolist()):
        before = _line(rows, u, (u > place - WINDOW_M) & (u < place - GUARD_M), place)
        after = _line(rows, u, (u > place + GUARD_M) & (u < place + WINDOW_M), place)
        found.valley[k], found.bottom[k] = _valley(before, after, place)
        found.step[k], found.step_m[k] = _step(rows, u - place)
    return found


def _line(rows: FloatArray, u: FloatArray, chosen: BoolArray, place: float) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Of each row: height at the place, slope, and whether the cells lie on the line."""
    z, x = rows[chosen], u[chosen] - place
    known = np.isfinite(z)
    n = known.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        z0 = np.where(known, z, 0.0)
        mean_x, mean_z = (x @ known) / n, z0.sum(axis=0) / n
        spread = (x**2) @ known - n * mean_x**2
        slope = (x @ z0 - n * mean_x * mean_z) / spread
        height = mean_z - slope * mean_x
        near = (np.abs(z - height - np.multiply.outer(x, slope)) < STRAIGHT_M) & known
        straight = (n >= 0.6 * max(len(x), 1)) & (n >= 4) & (near.sum(axis=0) >= 0.5 * n)
    return height, slope, straight


def _valley(
    before: tuple[FloatArray, FloatArray, BoolArray], after: tuple[FloatArray, FloatArray, BoolArray], place: float
) -> tuple[float, float]:
    """How much it is one, and where its bottom is."""
    main = _main(before[0], after[0])
    if main.sum() < LEAST_ROWS:
        return 0.0, float("nan")
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = after[1] - before[1]
        meet = (before[0] - after[0]) / bend
        open_ = np.minimum(-before[1], after[1]) > FALLS
        valley = main & (bend > LEAST_BEND) & open_ & (np.abs(meet) < MEET_M) & before[2] & after[2]
    long = _ramp(float(valley.sum() / main.sum()), VALLEY_SHARE)
    if long == 0.0:
        return 0.0, float("nan")
    steep = min(float(np.median(bend[valley])) / CLEAR_BEND, 1.0)
    return long * steep, place + float(np.median(meet[valley]))


def _step(rows: FloatArray, x: FloatArray) -> tuple[float, float]:
    """How much there is one, and its height."""
    middle = (STEP_NEAR_M + STEP_FAR_M) / 2
    far_before, before = (
        _level(rows, (x > -STEP_FAR_M) & (x < -middle)),
        _level(rows, (x > -middle) & (x < -STEP_NEAR_M)),
    )
    after, far_after = _level(rows, (x > STEP_NEAR_M) & (x < middle)), _level(rows, (x > middle) & (x < STEP_FAR_M))
    main = _main((far_before + before) / 2, (after + far_after) / 2)
    if main.sum() < LEAST_ROWS:
        return 0.0, 0.0
    difference = ((after + far_after) / 2 - (before + far_before) / 2)[main]
    # what the steeper side would give over the distance of both middles is no step
    steepest = np.maximum(np.abs(far_after - after), np.abs(before - far_before))[main] / (middle - STEP_NEAR_M)
    sharp = np.sign(difference) * np.maximum(np.abs(difference) - 2 * middle * steepest, 0.0)
    sides = [sharp > LEAST_STEP_M, sharp < -LEAST_STEP_M]
    stepping = max(sides, key=lambda s: float(s.mean()))
    long = _ramp(float(stepping.mean()), STEP_SHARE)
    return long, float(np.median(np.abs(difference[stepping]))) if long else 0.0


def _level(rows: FloatArray, chosen: BoolArray) -> FloatArray:
    """Mean of each row; NaN where half of it or more is unknown."""
    part = rows[chosen]
    known = np.isfinite(part)
    n = known.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(n > 0.5 * len(part), np.where(known, part, 0.0).sum(axis=0) / n, np.nan)


def _main(before: FloatArray, after: FloatArray) -> BoolArray:
    """Rows that are known on both sides and not far below the others."""
    known = np.isfinite(before) & np.isfinite(after)
    if not known.any():
        return known
    top = np.fmax(before, after)
    return known & (top > np.median(top[known]) - MAIN_M)


def _ramp(share: float, limits: tuple[float, float]) -> float:
    return float(np.clip((share - limits[0]) / (limits[1] - limits[0]), 0, 1))
