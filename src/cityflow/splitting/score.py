"""How likely is a border at each station: what each kind of evidence adds to the logarithm of the odds.

Every kind is first measured against its own usual size over the piece, so a restless roof or façade weighs less than a quiet one. None can add
without limit, and two that agree (both façades; segments on façade and roof in one slice, as Dahlke asks) are worth more than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.piece_evidence import PieceEvidence, at_stations
from cityflow.splitting.score_colour import Change

PRIOR = -5.0
"""Logarithm of the odds of a border where nothing is known."""
ROOF_MOST, ROOF_AT = 6.0, 3.5
FACADE_MOST, FACADE_AT = 5.0, 4.0
STEP_MOST, STEP_AT = 6.5, 4.0
SLOPED_MOST, VERTICAL_MOST, COPLANAR = 2.0, 1.2, 1.0
STOREY_M = 1.8
"""A step of this size and more, with all colours the same, is rather one of a single stepped building."""
SAME_COLOURS = -4.5
SAW_TOOTH = -8.0


@dataclass(frozen=True, slots=True)
class Score:
    """(S,) each: logarithm of the odds, and what each kind adds to it."""

    total: FloatArray
    height: FloatArray
    roof: FloatArray
    facade: FloatArray
    segments: FloatArray


def score(evidence: PieceEvidence) -> Score:
    """Add up the evidence at every station."""
    height, roof = _height(evidence), _roof(evidence)
    sides = [_facade(changes, len(evidence.stations)) for changes in evidence.facades]
    facade = _both(*sides)
    segments = _segments(evidence)
    doubt = _stepped_building(evidence, roof, facade) + _saw_tooth(evidence)
    total = PRIOR + height + roof + facade + segments + doubt
    return Score(total, height, roof, facade, segments)


def _saturating(size: FloatArray, most: float, at: float) -> FloatArray:
    """`most` in the end, 63 % of it at `at`, little below half of `at`."""
    return np.asarray(most * (1 - np.exp(-((at_stations(size) / at) ** 2))))


def _height(evidence: PieceEvidence) -> FloatArray:
    change = evidence.height
    return np.asarray(_saturating(change.significance, STEP_MOST, STEP_AT) * at_stations(change.share) ** 2)


def _roof(evidence: PieceEvidence) -> FloatArray:
    if evidence.roof_colour is None:
        return np.zeros(len(evidence.stations))
    return _saturating(evidence.roof_colour.significance, ROOF_MOST, ROOF_AT)


def _facade(changes: Sequence[Change], stations: int) -> FloatArray:
    """Of one side: the frame that shows most of it counts."""
    if not changes:
        return np.zeros(stations)
    best = max(changes, key=lambda c: float(np.isfinite(c.image).mean()))
    return _saturating(best.significance / 2.0, FACADE_MOST, FACADE_AT)


def _both(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(one, other) + 0.6 * np.minimum(one, other))


def _segments(evidence: PieceEvidence) -> FloatArray:
    slices = evidence.slices
    vertical = np.clip((slices.vertical - 0.3) / 0.5, 0, 1)
    sloped = np.clip((slices.sloped - 0.35) / 0.4, 0, 1)
    coplanar = np.minimum(vertical.max(axis=1), sloped)
    return np.asarray(SLOPED_MOST * sloped + VERTICAL_MOST * vertical.sum(axis=1) + COPLANAR * coplanar)


def _stepped_building(evidence: PieceEvidence, roof: FloatArray, facade: FloatArray) -> FloatArray:
    if evidence.roof_colour is None:
        return np.zeros(len(evidence.stations))
    tall = at_stations(evidence.height.step_m) > STOREY_M
    return np.where(tall & (roof < 1.5) & (facade < 1.5), SAME_COLOURS, 0.0)


def _saw_tooth(evidence: PieceEvidence) -> FloatArray:
    """Roofs that rise along the axis on both sides of a step and fall back at it."""
    change = evidence.height
    slope = at_stations(change.slope)
    alike = (np.abs(slope).min(axis=1) > 0.08) & (np.abs(slope[:, 0] - slope[:, 1]) < 0.3 * np.abs(slope).max(axis=1))
    back = np.sign(slope[:, 0]) == -np.sign(at_stations(change.signed_m))
    return np.where(alike & back & (at_stations(change.step_m) > 0.5), SAW_TOOTH, 0.0)
