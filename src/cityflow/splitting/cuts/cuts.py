"""From evidence at stations to cut lines: maxima, their positions to a fraction of a slice, lines across the outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from shapely import LineString, Point, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import CutLine
from cityflow.splitting.cuts.cut_chords import line_at
from cityflow.splitting.cuts.cut_places import REACH_M, place
from cityflow.splitting.scores.border_sides import Sides
from cityflow.splitting.scores.score import score
from cityflow.splitting.scores.weigh import Noise, weigh
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.strip_evidence import StripEvidence
from cityflow.splitting.strips.strip_rasters import CONTEXT_M

APART_M = 1.8
"""Maxima nearer to one another than this are one."""
FREE_END_M = 2.0
"""No border is nearer to a free end of a row."""
LEAST_SCORE = 1.2
"""Weaker maxima of the scan are no proposals."""
LEAST_LOG_ODDS = -3.0
"""Weaker borders are not even named among the rejected."""
CROSSWISE_ODDS, SHORT_WING_ODDS, SHORT_WING_M = 2.0, 1.5, 8.0
AT_END_M = 1.2
CONTROL_STEP_M, CONTROL_CLEAR_M = 1.5, 1.4
"""What is usual where there is no border is measured so densely, so far from borders and ends."""
QUANTILE, QUANTILE_SIGMAS = 0.75, 1.15
"""Steps of heights: errors that are alike over metres make few large ones."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A possible border: its place along the strip, the logarithm of its odds, the line."""

    u: float
    log_odds: float
    cut: CutLine


def candidates(evidence: StripEvidence, outline: Polygon, aspect_sigma_deg: float) -> list[Candidate]:
    """Possible borders of a strip: proposed by the scan, then weighed between one another, strongest first.

    Parameters
    ----------
    outline : that the lines shall cross
    aspect_sigma_deg : standard deviation of the strip's direction, degrees
    """
    places = proposals(evidence, outline)
    handicap = handicap_of(evidence.strip)
    whole = _reach(evidence, outline)
    chosen = _chosen(evidence, places, Noise(), handicap, whole)
    noise = _background(evidence, chosen)
    chosen = _chosen(evidence, places, noise, handicap, whole)
    found = []
    for u in places:
        weighed = weigh(evidence, u, _sides(whole, [c for c in chosen if c != u], u), noise)
        log_odds = weighed.log_odds - handicap
        line = line_at(evidence.strip, outline, u)
        if line is not None and log_odds >= LEAST_LOG_ODDS:
            cut = _cut(evidence, u, line, (log_odds, weighed.step_m), aspect_sigma_deg)
            found.append(Candidate(u, log_odds, cut))
    return sorted(found, key=lambda c: (-c.log_odds, c.u))


def handicap_of(strip: AxisStrip) -> float:
    """By how much less likely borders are across what is rather deep than long, or a short wing of a house."""
    if strip.depth > strip.chain_m:
        return CROSSWISE_ODDS
    return SHORT_WING_ODDS if strip.chain_m < SHORT_WING_M else 0.0


def proposals(evidence: StripEvidence, outline: Polygon) -> list[float]:
    """Places of the maxima of the scan; the end of the strip too where another wing begins and one is near."""
    scores = score(evidence)
    total = _allowed(evidence.strip, outline, scores.total)
    found = [k for k in maxima(total, evidence.stations, APART_M) if total[k] > LEAST_SCORE]
    places = [place(evidence, scores, k) for k in found]
    ends = [float(evidence.stations[k]) for k in (0, -1) if np.isfinite(total[k])]
    ends = [e for e in ends if any(abs(p - e) < AT_END_M for p in places)]
    return sorted(dict.fromkeys(places + ends))


def _chosen(
    evidence: StripEvidence, places: Sequence[float], noise: Noise, handicap: float, whole: Sides
) -> list[float]:
    """Borders that are likelier than not: each weighed alone, taken strongest first as long as it holds between those already there."""
    alone = [weigh(evidence, u, whole, noise).log_odds - handicap for u in places]
    chosen: list[float] = []
    for k in sorted(range(len(places)), key=lambda k: (-alone[k], places[k])):
        if alone[k] <= 0:
            break
        if weigh(evidence, places[k], _sides(whole, chosen, places[k]), noise).log_odds > handicap:
            chosen.append(places[k])
    return _settled(evidence, chosen, noise, handicap, whole)


def _settled(
    evidence: StripEvidence, chosen: Sequence[float], noise: Noise, handicap: float, whole: Sides
) -> list[float]:
    """Without those that do not hold between their final neighbours; the weakest goes first."""
    left = list(chosen)
    while left:
        odds = [weigh(evidence, u, _sides(whole, [c for c in left if c != u], u), noise).log_odds for u in left]
        weakest = int(np.argmin(odds))
        if odds[weakest] > handicap:
            break
        left.pop(weakest)
    return sorted(left)


def _reach(evidence: StripEvidence, outline: Polygon) -> Sides:
    """How far one may look at all: beyond an end only where another wing begins."""
    strip = evidence.strip
    first, last = (0.0 if _is_free(strip, outline, end) else CONTEXT_M for end in (0, -1))
    return Sides(float(strip.stations[0]) - first, float(strip.stations[-1]) + last)


def _sides(whole: Sides, chosen: Sequence[float], u: float) -> Sides:
    return Sides(
        max([c for c in chosen if c < u], default=whole.left), min([c for c in chosen if c > u], default=whole.right)
    )


def _background(evidence: StripEvidence, chosen: Sequence[float]) -> Noise:
    """What changes where there is no border: between those that were found, and beside them."""
    ends = [float(evidence.stations[0]), *chosen, float(evidence.stations[-1])]
    controls = [weigh(evidence, u, Sides(a, b), Noise()) for a, b in pairwise(ends) for u in _between(a, b)]
    if len(controls) < 3:
        return Noise()
    plain = Noise()
    facades = [f for c in controls for f in c.facade_change]
    steps = float(np.quantile([c.step_m for c in controls], QUANTILE)) / QUANTILE_SIGMAS
    return Noise(
        max(plain.height_m, steps),
        max(plain.roof, _middle([c.roof_change for c in controls])),
        max(plain.facade, _middle(facades)),
    )


def _between(a: float, b: float) -> FloatArray:
    """Places between two borders, three at least; none where they are near one another."""
    if b - a <= 4.0:
        return np.empty(0)
    number = max(int((b - a - 2 * CONTROL_CLEAR_M) / CONTROL_STEP_M) + 1, 3)
    clear = min(CONTROL_CLEAR_M, 0.35 * (b - a))
    return np.linspace(a + clear, b - clear, number)


def _middle(values: Sequence[float]) -> float:
    known = [v for v in values if np.isfinite(v)]
    return 1.2 * float(np.median(known)) if known else 0.0


def _cut(
    evidence: StripEvidence, u: float, line: LineString, odds_and_step: tuple[float, float], sigma: float
) -> CutLine:
    near = np.abs(evidence.stations - u) < 0.25
    near[int(np.argmin(np.abs(evidence.stations - u)))] = True
    log_odds, step_m = odds_and_step
    return CutLine(
        line,
        "cut",
        vertical=float(min(evidence.slices.vertical[near].max(), 1.0)),
        sloped=float(evidence.slices.sloped[near].max()),
        height_step_m=step_m,
        confidence=float(1 / (1 + np.exp(-log_odds))),
        angle_sigma_deg=sigma,
    )


def _allowed(strip: AxisStrip, outline: Polygon, total: FloatArray) -> FloatArray:
    """Without stations at free ends of a row."""
    allowed = total.copy()
    for end in (0, -1):
        if _is_free(strip, outline, end):
            allowed[np.abs(strip.stations - strip.stations[end]) < FREE_END_M] = -np.inf
    return allowed


def _is_free(strip: AxisStrip, outline: Polygon, end: int) -> bool:
    """Whether nothing of the outline goes on beyond an end (0 or -1) of a strip."""
    inward = 1 if end == 0 else -1
    middle = (strip.low[end] + strip.high[end]) / 2
    return not outline.contains(Point(strip.to_world(np.array([strip.stations[end] - inward * 1.0, middle]))))


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
