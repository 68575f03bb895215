"""Evidence of heights for a border across a row: valleys, steps, firewalls, trenches.

The roof is cut into rows along the axis. At every place a line is fitted to each row before it and another after it, short enough to end before the
ridge of a narrow house. Prolonged to the place, both lines tell four things. They step: eaves or ridges differ, or the whole profile does. They open
upwards and meet: the gutter between two gables that stand side by side. They are both lower than what lies at the place itself: a firewall or parapet;
or both much higher: a gap too narrow for more than a few points.
A dormer, a chimney, a penthouse does the same over a part of the depth only, so what counts is the share of rows that agree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.splitting.scores.medians import lower_median
from cityflow.splitting.strips.strip_rasters import RoofRaster

ROW_M = 0.4
WINDOW_M, GUARD_M = 1.7, 0.35
KNOWN = 0.6
"""Share of a window that must be known."""
MAIN_M = 2.5
"""Rows lower than half of all by more than this are no part of the main roof."""
REACH_M = 0.3
"""A bend this far from the place explains what looks like a step."""
LEAST_STEP_M, LEAST_WALL_M, LEAST_BEND = 0.14, 0.12, 0.4
SIGMAS = 3.5
NEAR = 2
"""Cells beside a place that say how sharp a step is."""
STRAIGHT_M, STRAIGHT_SIGMAS = 0.06, 2.5
"""Where one side is no line there is no telling of a step: another edge, or a ridge, lies within reach."""
LEAST_RISE = 0.12
"""Tangent: both sides of a valley rise away from it by at least this."""
TRENCH_M = 1.0
MEET_M = 0.7
"""Both lines of a valley meet within this of the place."""
LEAST_ROWS = 3
FLOOR_M = 0.02


@dataclass(frozen=True, slots=True)
class RoofMarks:
    """At each of S places along the row.

    Attributes
    ----------
    u : (S,) places, metres
    step, valley, wall, trench : (S,) share of the main roof's rows that step, open upwards, have a wall, have a trench
    ridge, marked : (S,) share that fall to both sides, that have any of the other four
    bottom : (S,) where the valley's bottom lies; NaN where there is none
    off : (S,) how far rows are off their lines, on the side where they are farther, median, metres
    """

    u: FloatArray
    step: FloatArray
    valley: FloatArray
    wall: FloatArray
    trench: FloatArray
    ridge: FloatArray
    marked: FloatArray
    bottom: FloatArray
    off: FloatArray


@dataclass(frozen=True, slots=True)
class Lines:
    """(S, R) heights at the places, slopes along the axis, distances from the line; heights and slopes of the nearest cells alone."""

    height: FloatArray
    slope: FloatArray
    off: FloatArray
    near: FloatArray
    near_slope: FloatArray


def roof_rows(roof: RoofRaster) -> FloatArray:
    """(U, R) heights of a roof along the axis, medians over 0.4 m of the depth; NaN unknown."""
    cell = float(roof.v[1] - roof.v[0])
    known = np.flatnonzero(np.isfinite(roof.height).any(axis=0))
    if not len(known):
        return np.full((len(roof.u), 1), np.nan)
    width = max(round(ROW_M / cell), 1)
    first = max(known[0] - (known[0] + round(float(roof.v[0]) / cell)) % width, 0)  # whatever the outline's extremes
    part = roof.height[:, first : known[-1] + 1].astype(np.float64)
    count = max(part.shape[1] // width, 1)
    cut = part[:, : count * width].reshape(len(roof.u), count, -1)
    return lower_median(cut, np.isfinite(cut))


def roof_marks(rows: FloatArray, u: FloatArray) -> RoofMarks:
    """Marks at the borders between columns.

    Parameters
    ----------
    rows : (U, R) heights along the row, metres; NaN unknown
    u : (U,) where the columns stand, evenly spaced, metres
    """
    cell = float(u[1] - u[0])
    guard, width = max(round(GUARD_M / cell), 1), max(round((WINDOW_M - GUARD_M) / cell), 4)
    # window k begins at column k; the place k lies before column k
    ends = np.pad(rows, ((guard + width, guard + width), (0, 0)), constant_values=np.nan)
    windows = sliding_window_view(ends, width, axis=0)
    x: FloatArray = np.asarray((np.arange(width) + 0.5 + guard) * cell, np.float64)
    places = np.arange(len(u) + 1)
    before = fitted_lines(windows[places], -x[::-1])
    after = fitted_lines(windows[places + 2 * guard + width], x)
    noise = _noise(before, after)
    main = _main(before.height, after.height)
    found = _marks(before, after, _between(rows, guard), main, (noise, (2 * guard + NEAR) * cell))
    at = u[0] + (places - 0.5) * cell
    step, valley, wall, trench, ridge, marked, meet = found
    off = np.fmax(before.off, after.off)
    return RoofMarks(at, step, valley, wall, trench, ridge, marked, at + meet, lower_median(off, np.isfinite(off)))


def fitted_lines(windows: FloatArray, x: FloatArray) -> Lines:
    """Least-squares lines through windows (S, R, W)."""
    known = np.isfinite(windows)
    n = known.sum(axis=2)
    z = np.where(known, windows, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_x, mean_z = known @ x / n, z.sum(axis=2) / n
        s_xx = known @ x**2 - n * mean_x**2
        slope = (z @ x - n * mean_x * mean_z) / s_xx
        height = mean_z - slope * mean_x
        off = np.abs(z - height[..., None] - slope[..., None] * x) * known
        spread = off.sum(axis=2) / n
    enough = n >= KNOWN * len(x)
    height, slope, spread = (np.where(enough, a, np.nan) for a in (height, slope, spread))
    order = np.argsort(np.abs(x), kind="stable")
    first, second = order[:NEAR], order[NEAR : 2 * NEAR]
    near, next_ = windows[..., first].mean(axis=2), windows[..., second].mean(axis=2)
    return Lines(height, slope, spread, near, (near - next_) / (x[first].mean() - x[second].mean()))


def _noise(before: Lines, after: Lines) -> float:
    off = np.fmin(before.off, after.off)
    off = off[np.isfinite(off)]
    return max(FLOOR_M, 1.25 * float(np.median(off))) if len(off) else FLOOR_M


def _main(before: FloatArray, after: FloatArray) -> BoolArray:
    """Rows that are known on both sides and not far below the others."""
    known = np.isfinite(before) & np.isfinite(after)
    top = np.where(known, np.fmax(before, after), -np.inf)
    ordered = np.sort(top, axis=1)
    number = known.sum(axis=1)
    half = np.take_along_axis(
        ordered, (top.shape[1] - (number + 1) // 2 - 1).clip(0, top.shape[1] - 1)[:, None], axis=1
    )
    with np.errstate(invalid="ignore"):
        return np.asarray(known & (top > half - MAIN_M))


def _between(rows: FloatArray, guard: int) -> tuple[FloatArray, FloatArray]:
    """(S, R) second lowest and second highest of the cells around each place: a single one may be a bird or a wire."""
    second = 1 if guard > 1 else 0
    padded = np.pad(rows, ((guard, guard), (0, 0)), constant_values=np.nan)
    around = sliding_window_view(padded, 2 * guard, axis=0)
    low = np.sort(np.where(np.isfinite(around), around, np.inf), axis=2)[..., second]
    high = np.sort(np.where(np.isfinite(around), around, -np.inf), axis=2)[..., -1 - second]
    return low, high


def _marks(
    before: Lines,
    after: Lines,
    middle: tuple[FloatArray, FloatArray],
    main: BoolArray,
    noise_and_apart: tuple[float, float],
) -> tuple[FloatArray, ...]:
    (noise, apart_m), (lowest, highest) = noise_and_apart, middle
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = after.slope - before.slope
        difference = after.height - before.height
        size = np.maximum(np.abs(difference) - REACH_M * np.abs(bend), 0.0)
        least = max(LEAST_STEP_M, SIGMAS * noise)
        size = np.minimum(size, _sharp(before, after, apart_m) * np.sign(difference))
        straight = np.fmax(before.off, after.off) < max(STRAIGHT_M, STRAIGHT_SIGMAS * noise)
        steps = main & straight & (size > least)
        meet = -difference / bend
        rising = np.minimum(-before.slope, after.slope) > LEAST_RISE
        ridge = main & (bend < -LEAST_BEND) & (np.abs(meet) < MEET_M)
        valley = main & (bend > LEAST_BEND) & rising & (np.abs(meet) < MEET_M)
        wall = main & (highest - np.fmax(before.height, after.height) > max(LEAST_WALL_M, SIGMAS * noise))
        trench = main & (np.fmin(before.height, after.height) - lowest > TRENCH_M)
    number = np.maximum(main.sum(axis=1), 1)
    enough = main.sum(axis=1) >= LEAST_ROWS

    def share(which: BoolArray) -> FloatArray:
        return np.where(enough, which.sum(axis=1) / number, 0.0)

    return (
        share(steps), share(valley), share(wall), share(trench), share(ridge), share(steps | valley | wall | trench),
        lower_median(meet, valley),
    )  # fmt: skip


def _sharp(before: Lines, after: Lines, apart_m: float) -> FloatArray:
    """Difference of the nearest cells on both sides beyond what the steepest slope there explains, signed."""
    steep = np.maximum.reduce([np.abs(s) for s in (before.slope, after.slope, before.near_slope, after.near_slope)])
    difference = after.near - before.near
    return np.asarray(np.sign(difference) * np.maximum(np.abs(difference) - apart_m * steep, 0.0))
