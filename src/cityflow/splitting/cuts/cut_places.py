"""Position of a border, to a fraction of a slice: the weighted median of all kinds of evidence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.splitting.borders.border_position import REACH_M, edge_position, roof_position
from cityflow.splitting.scores.border_sides import DARK
from cityflow.splitting.scores.medians import middle_of_known
from cityflow.splitting.scores.score import Score
from cityflow.splitting.scores.score_colour import Change
from cityflow.splitting.strips.strip_evidence import StripEvidence, at_stations

TOGETHER_M = 0.3
"""Places that agree within this are averaged."""


def place(evidence: StripEvidence, scores: Score, k: int) -> float:
    """The border near station k, from every source that changes there; robust mean of where each changes."""
    u_0 = float(evidence.stations[k])
    places = [(u_0, 0.05)]
    if scores.height[k] > 1.0:
        by_roof = roof_position(evidence.marks, evidence.rows, evidence.roof.u, u_0)
        places += [(by_roof, 4.0)] if by_roof is not None and abs(by_roof - u_0) < REACH_M else []
    if evidence.roof_colour is not None and scores.roof[k] > 1.0:
        places += _from_colour(evidence.roof_colour, k, u_0, 3.0)
    for changes in evidence.facades:
        for change in changes:
            if at_stations(change.significance)[k] > 4.0:
                places += _from_colour(change, k, u_0, 2.0)
    places += _from_slices(evidence, k)
    return _agreed(places)


def _from_colour(change: Change, k: int, u_0: float, weight: float) -> list[tuple[float, float]]:
    """Each column is told to be like what lies before or like what lies after; the border parts them best."""
    image, u = change.image, change.u
    before = image[(u > u_0 - 2.0) & (u < u_0 - 0.4)]
    after = image[(u > u_0 + 0.4) & (u < u_0 + 2.0)]
    if not before.size or not after.size:
        return []
    low, high = _row_levels(before), _row_levels(after)
    apart = high - low
    size = (apart**2).sum(axis=1)
    signed = change.signed[k]
    alike = (apart / (0.5 * (low + high) + DARK)) @ signed / float(signed @ signed)
    # windows and doors change more than the wall does, and elsewhere
    clear = (alike > 0.5) & (alike < 2.0)
    if clear.sum() < 4:
        return []
    share = ((image - (low + high) / 2)[:, clear] * apart[clear]).sum(axis=2) / size[clear]
    at = edge_position(np.clip(share, -0.5, 0.5), u, u_0)
    return [] if at is None else [(at, weight)]


def _row_levels(part: Float32Array) -> FloatArray:
    """(Z, C) median over columns; NaN where hardly anything is known."""
    result = np.full(part.shape[1:], np.nan)
    known = np.isfinite(part[..., 0]).sum(axis=0) >= max(0.3 * len(part), 2)
    result[known] = middle_of_known(part[:, known])
    return result


def _from_slices(evidence: StripEvidence, k: int) -> list[tuple[float, float]]:
    """The weighted middle of adjacent slices that segments mark."""
    weight = evidence.slices.sloped + evidence.slices.vertical.sum(axis=1)
    near = np.abs(evidence.stations - evidence.stations[k]) < 0.5
    strong = near & (weight > 0.6 * max(float(weight[near].max()), 0.6))
    if not strong.any():
        return []
    return [(float(np.average(evidence.stations[strong], weights=weight[strong])), 1.0)]


def _agreed(places: Sequence[tuple[float, float]]) -> float:
    """Weighted median, then the mean of what lies near it."""
    u = np.array([p[0] for p in places])
    weight = np.array([p[1] for p in places])
    order = np.argsort(u, kind="stable")
    middle = u[order][int(np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2))]
    near = np.abs(u - middle) < TOGETHER_M
    return float(np.average(u[near], weights=weight[near]))
