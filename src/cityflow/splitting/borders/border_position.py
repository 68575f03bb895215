"""Where a border runs, to a fraction of a station: by the mark of the roof that most of its depth has, else by the outline."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.roof_marks import RoofMarks
from cityflow.splitting.cuts.cut_places import edge_position
from cityflow.splitting.strips.axis_strips import AxisStrip

NEAR_M = 0.5
LEAST_SHARE = 0.15
"""Marks over a lesser share of the depth do not place a border."""
SETBACK_M = 0.3
STEP_M = 0.2


def border_position(strip: AxisStrip, marks: RoofMarks, rows: FloatArray, u: FloatArray, near_u: float) -> float:
    """The bottom of the valley, where the rows step, the middle of the wall or trench; else where the outline steps; else as given.

    Parameters
    ----------
    rows, u : (U, R) heights along the row, (U,) where their columns stand, metres
    near_u : the place by the stations
    """
    near = np.abs(marks.u - near_u) < NEAR_M
    narrow = np.maximum(marks.wall, marks.trench)
    step, valley, wall = (float(m[near].max(initial=0.0)) for m in (marks.step, marks.valley, narrow))
    if max(step, valley, wall) < LEAST_SHARE:
        return _at_setback(strip, near_u)
    if valley >= max(step, wall):
        good = near & np.isfinite(marks.bottom) & (marks.valley > 0.7 * valley)
        return float(np.median(marks.bottom[good]))
    weight = np.where(near, (marks.step + narrow) ** 2, 0.0)
    middle = float(np.average(marks.u, weights=weight))
    at = where_rows_step(rows, u, middle) if step >= wall else None
    return middle if at is None else at


def _at_setback(strip: AxisStrip, near_u: float) -> float:
    """The nearest place where an end of the chords jumps, or the place itself."""
    jump = np.maximum(np.abs(np.diff(strip.low)), np.abs(np.diff(strip.high)))
    middle = (strip.stations[:-1] + strip.stations[1:]) / 2
    there = np.flatnonzero((jump > SETBACK_M) & (np.abs(middle - near_u) < NEAR_M))
    return float(middle[there[int(np.argmax(jump[there]))]]) if len(there) else near_u


def where_rows_step(rows: FloatArray, u: FloatArray, at: float) -> float | None:
    """Where most of the rows that step clearly turn from what is before to what is after."""
    before = rows[(u > at - 1.2) & (u < at - 0.35)]
    after = rows[(u < at + 1.2) & (u > at + 0.35)]
    known = np.isfinite(before).all(axis=0) & np.isfinite(after).all(axis=0)
    low, high = np.median(before[:, known], axis=0), np.median(after[:, known], axis=0)
    clear = np.abs(high - low) > STEP_M
    if clear.sum() < 3:
        return None
    share = (rows[:, known][:, clear] - (low + high)[clear] / 2) / (high - low)[clear]
    return edge_position(np.clip(share, -0.5, 0.5), u, at)
