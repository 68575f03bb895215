"""Score of borders at each station: the sum of all changes; its maxima are proposals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.roof_marks import RoofMarks
from cityflow.splitting.scores.score_colour import Change
from cityflow.splitting.strips.strip_evidence import StripEvidence, at_stations

MOST = 5.0
"""No kind of evidence adds more."""
CLEAR = 3.5
FACADE_CLEAR = 5.0
SECOND_FACADE = 0.6
VALLEY = 3.0
STRAIGHT_M = 0.12
"""What is farther from its line, in the mean, is no slope: a step lies within reach."""


@dataclass(frozen=True, slots=True)
class Score:
    """(S,) each: sum, and what each kind adds to it."""

    total: FloatArray
    height: FloatArray
    roof: FloatArray
    facade: FloatArray
    segments: FloatArray


def score(evidence: StripEvidence) -> Score:
    """Add up the evidence at every station; segments count as Dahlke has it, most where they are coplanar."""
    stations = len(evidence.stations)
    height = np.interp(evidence.stations, evidence.marks.u, of_shape(evidence.marks))
    roof = np.zeros(stations)
    if evidence.roof_colour is not None:
        roof = _saturating(evidence.roof_colour.significance, CLEAR)
    one, other = (_facade(changes, stations) for changes in evidence.facades)
    facade = np.maximum(one, other) + SECOND_FACADE * np.minimum(one, other)
    segments = _segments(evidence)
    return Score(height + roof + facade + segments, height, roof, facade, segments)


def of_shape(marks: RoofMarks) -> FloatArray:
    """(S,) at the places of the marks; where a step lies within reach there is no valley."""
    return np.asarray(MOST * marks.step**2 + np.where(marks.off < STRAIGHT_M, VALLEY * marks.valley, 0.0))


def _saturating(size: FloatArray, at: float) -> FloatArray:
    return np.asarray(MOST * (1 - np.exp(-((at_stations(size) / at) ** 2))))


def _facade(changes: Sequence[Change], stations: int) -> FloatArray:
    """Of one side: the local frame that shows most of it counts."""
    if not changes:
        return np.zeros(stations)
    return _saturating(max(changes, key=lambda c: c.seen).significance, FACADE_CLEAR)


def _segments(evidence: StripEvidence) -> FloatArray:
    slices = evidence.slices
    vertical = np.clip((slices.vertical - 0.3) / 0.5, 0, 1)
    sloped = np.clip((slices.sloped - 0.3) / 0.4, 0, 1)
    pipes = np.minimum(evidence.stripes / CLEAR, 1).sum(axis=1)
    coplanar = np.minimum(vertical.max(axis=1), sloped)
    return np.asarray(1.5 * sloped + vertical.sum(axis=1) + 1.5 * coplanar + 1.5 * pipes)
