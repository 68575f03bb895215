"""How the colour of a façade changes at a border: sharply, to last, and where it is known on both sides."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.splitting.scores.border_sides import DARK, Sides, change_across, most_of, share_of
from cityflow.splitting.scores.score_colour import Change

FACADE_SIDE_M, FACADE_GUARD_M = 4.0, 0.2
FACADE_LASTS_M = 8.0
"""A change of a façade that is gone over this length was a bay, a staircase or a stack of balconies."""
ROWS_KNOWN, FACADE_TRUSTED = 0.15, (0.1, 0.4)
"""Share of a row's cells that must be known on either side for it to be compared; share of the façade's rows that are, below
the first of which the façade says nothing, above the second all it can."""
SHARP_M, SHARP_GUARD_M = 1.2, 0.2


class FacadeChange(NamedTuple):
    """Relative change of a façade's colour in the local frame that shows most of it, and of its hue; NaN where not known. How much it counts, 0 to 1:
    where it is sharp, lasts, and enough of the façade is known on both sides."""

    size: float = float("nan")
    hue: float = float("nan")
    counts: float = 0.0


def facade_change(changes: tuple[Change, ...], u: float, sides: Sides) -> FacadeChange:
    if not changes:
        return FacadeChange()
    best = max(changes, key=lambda c: c.seen)
    rows, trust = _rows_of_both(best, u, sides)
    if trust <= 0:
        return FacadeChange()
    part = replace(best, image=np.ascontiguousarray(best.image[:, rows]))
    edges = np.array([0, part.image.shape[1]], np.int64)
    ratio = change_across(part.image, part.u, u, sides, edges, (FACADE_SIDE_M, FACADE_GUARD_M))[0]
    if not np.isfinite(ratio).all():
        return FacadeChange()
    far = change_across(part.image, part.u, u, sides, edges, (FACADE_LASTS_M, FACADE_GUARD_M))[0]
    left = float(far @ ratio) / max(float(ratio @ ratio), 1e-9) if np.isfinite(far).all() else 1.0
    size, hue = float(np.abs(ratio).max()), float(np.abs(ratio - ratio.mean()).max())
    return FacadeChange(size, hue, trust * most_of(left) * _sharp(part, u, ratio))


def _rows_of_both(change: Change, u: float, sides: Sides) -> tuple[BoolArray, float]:
    """(Z,) rows of a façade that are known before and after u, and how far what they say may be trusted, 0 to 1."""
    at, known = change.u, np.isfinite(change.image[..., 0])
    before = known[(at > max(sides.left, u - FACADE_SIDE_M)) & (at < u - FACADE_GUARD_M)]
    after = known[(at < min(sides.right, u + FACADE_SIDE_M)) & (at > u + FACADE_GUARD_M)]
    if min(len(before), len(after)) < 2:
        return np.zeros(known.shape[1], bool), 0.0
    rows = np.minimum(before.mean(axis=0), after.mean(axis=0)) >= ROWS_KNOWN
    share = float(rows.sum() / max(int(known.any(axis=0).sum()), 1))
    trust = np.clip((share - FACADE_TRUSTED[0]) / (FACADE_TRUSTED[1] - FACADE_TRUSTED[0]), 0, 1)
    return np.asarray(rows), float(trust) if rows.sum() >= 5 else 0.0


def _sharp(change: Change, u: float, ratio: FloatArray) -> float:
    """How much of the façade's height changes just at u the way that the whole does."""
    at = change.u
    before = change.image[(at > u - SHARP_M) & (at < u - SHARP_GUARD_M)]
    after = change.image[(at < u + SHARP_M) & (at > u + SHARP_GUARD_M)]
    low, high = _row_means(before), _row_means(after)
    near = (high - low) / (0.5 * (high + low) + DARK)
    known = np.isfinite(near).all(axis=1)
    if known.sum() < 5:
        return 0.0
    return share_of(near[known], ratio)


def _row_means(part: Float32Array) -> FloatArray:
    """(Z, C) means over columns of what is known."""
    known = np.isfinite(part)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(known, part, 0).sum(axis=0, dtype=np.float64) / known.sum(axis=0))
