"""Where a border runs, to a fraction of a cell: by the mark of the roof that most of its depth has, or by the outline; and where rows or columns turn."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.roof_marks import RoofMarks
from cityflow.splitting.scores.medians import middle_of_known
from cityflow.splitting.strips.axis_strips import AxisStrip

REACH_M = 0.9
"""How far from its maximum the place of a border is looked for."""
NEAR_M = 0.5
LEAST_SHARE = 0.15
"""Marks over a lesser share of the depth do not place a border."""
SETBACK_M = 0.3
STEP_M = 0.2


def roof_position(marks: RoofMarks, rows: FloatArray, u: FloatArray, near_u: float) -> float | None:
    """The bottom of the valley, where the rows step, or the middle of the wall or trench near a place; None without such a mark.

    Parameters
    ----------
    rows, u : (U, R) heights along the row, (U,) where their columns stand, metres
    """
    near = np.abs(marks.u - near_u) < NEAR_M
    narrow = np.maximum(marks.wall, marks.trench)
    step, valley, wall = (float(m[near].max(initial=0.0)) for m in (marks.step, marks.valley, narrow))
    if max(step, valley, wall) < LEAST_SHARE:
        return None
    if valley >= max(step, wall):
        good = near & np.isfinite(marks.bottom) & (marks.valley > 0.7 * valley)
        return float(np.median(marks.bottom[good]))
    weight = np.where(near, (marks.step + narrow) ** 2, 0.0)
    middle = float(np.average(marks.u, weights=weight))
    at = where_rows_step(rows, u, middle) if step >= wall else None
    return middle if at is None else at


def at_setback(strip: AxisStrip, near_u: float) -> float:
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


def edge_position(share: FloatArray, u: FloatArray, u_0: float) -> float | None:
    """Where columns turn from −0.5 to 0.5: the border before which most is negative and after which most is positive.

    Parameters
    ----------
    share : (U, R) of every row −0.5 (like what is before) to 0.5 (like what is after); NaN unknown
    """
    near = np.abs(u - u_0) < REACH_M + 0.5
    part = share[near]
    known = np.isfinite(part).any(axis=1)
    if known.sum() < 4:
        return None
    column = np.zeros(len(part))
    column[known] = middle_of_known(part[known].T)
    below = np.concatenate([[0.0], np.cumsum(column)])
    k = int(np.argmin(below))
    if k in (0, len(column)):
        return None
    cell = float(u[1] - u[0])
    # the columns beside the border are mixed: what they lack of a full half shifts it
    shift = (column[k - 1] + 0.5) - (0.5 - column[k])
    at = float(u[near][k] - cell / 2 - shift * cell)
    return at if abs(at - u_0) <= REACH_M else None
