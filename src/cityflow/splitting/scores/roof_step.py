"""The step of a roof at a place: lines along the axis, fitted before and after it and prolonged to it, row by row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.splitting.scores.medians import lower_median
from cityflow.splitting.strips.strip_evidence import StripEvidence

SIDE_M, GUARD_M = 2.5, 0.25
"""Lines reach so far from the place, and begin so far from it."""
RIDGE_M, BEND_M = 0.8, 0.4
"""A ridge, or another bend of the roof, may be this far from the place in question."""


@dataclass(frozen=True, slots=True)
class RoofStep:
    """Size (m) of a step, and in each part of the depth; unrest (m); slopes along the axis on both sides, and how much they differ."""

    size: float
    groups: FloatArray
    unrest: float
    before: float
    after: float

    @property
    def bend(self) -> float:
        return abs(self.after - self.before) if np.isfinite(self.after - self.before) else 0.0


def roof_step(evidence: StripEvidence, u: float, limits: tuple[float, float]) -> RoofStep:
    rows, at = evidence.rows, evidence.roof.u
    guard = max(GUARD_M, 1.5 * float(at[1] - at[0]))
    before = _lines(rows, at, (at > max(limits[0] + guard, u - SIDE_M)) & (at < u - guard), u)
    after = _lines(rows, at, (at < min(limits[1] - guard, u + SIDE_M)) & (at > u + guard), u)
    difference = _apart(after[0] - before[0], before[1], after[1])
    known = np.flatnonzero(np.isfinite(difference))
    if len(known) < max(3, 0.3 * rows.shape[1]):
        return RoofStep(0.0, np.zeros(0), 0.0, 0.0, 0.0)
    groups = np.array([np.median(difference[g]) for g in np.array_split(known, min(4, len(known)))])
    unrest = float(np.median(np.maximum(before[2], after[2])[known]))
    return RoofStep(
        float(np.median(np.abs(groups))), groups, unrest, float(np.median(before[1][known])), float(np.median(after[1][known])),
    )  # fmt: skip


def _apart(difference: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """Steps less what a bend within reach explains: there two slopes meet and nothing steps."""
    reach = np.where((before > 0) & (after < 0), RIDGE_M, BEND_M)
    return np.asarray(np.sign(difference) * np.maximum(np.abs(difference) - np.abs(after - before) * reach, 0.0))


def _lines(rows: FloatArray, at: FloatArray, chosen: BoolArray, u: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of each row a line through the chosen columns: height at u, slope, and median distance from it; NaN where too little is known."""
    z, x = rows[chosen], at[chosen] - u
    known = np.isfinite(z)
    n = known.sum(axis=0)
    nothing = np.full(rows.shape[1], np.nan)
    if len(x) < 4:
        return nothing, nothing, nothing
    values, weight = np.where(known, z, 0.0), known.astype(np.float64)
    height, slope = _fit(x, values, weight)
    off = np.abs(values - height - slope * x[:, None])
    # once more without what is far off: a chimney or dormer at the rim of the window
    scale = np.maximum(2.5 * _spread(off, known), 0.03)
    height, slope = _fit(x, values, weight * (off <= scale))
    enough = n >= 0.5 * len(x)
    spread = np.where(enough, _spread(np.abs(values - height - slope * x[:, None]), known), np.nan)
    return np.where(enough, height, np.nan), np.where(enough, slope, np.nan), spread


def _spread(off: FloatArray, known: BoolArray) -> FloatArray:
    """Median over the known rows of each column; 0 where none is."""
    return np.nan_to_num(lower_median(off.T, known.T))


def _fit(x: FloatArray, z: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted lines through columns of z: values at x = 0 and slopes; short windows lean towards level lines."""
    n, s_x, s_z = weight.sum(axis=0), x @ weight, (weight * z).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_x, mean_z = s_x / n, s_z / n
        s_xx = (x**2) @ weight - n * mean_x**2
        slope = (x @ (weight * z) - n * mean_x * mean_z) / (s_xx + 1e-9)
    return mean_z - slope * mean_x, slope
