"""From evidence at stations to cut lines: maxima, their places to a fraction of a slice, lines across the outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from shapely import LineString, Point, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import CutLine
from cityflow.splitting.cut_chords import line_at
from cityflow.splitting.cut_places import REACH_M, place
from cityflow.splitting.piece_evidence import PieceEvidence
from cityflow.splitting.score import score
from cityflow.splitting.skeleton import AxisPiece
from cityflow.splitting.strip_images import CONTEXT_M
from cityflow.splitting.weigh import Noise, Sides, Weighed, weigh

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
CONTROLS = (0.35, 0.5, 0.65)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A possible border: its place along the piece, the logarithm of its odds, the line, and what speaks for it."""

    u: float
    log_odds: float
    cut: CutLine
    weighed: Weighed


def candidates(evidence: PieceEvidence, outline: Polygon, aspect_sigma_deg: float) -> list[Candidate]:
    """Possible borders of a piece: proposed by the scan, then weighed between one another, strongest first.

    Parameters
    ----------
    outline : that the lines shall cross
    aspect_sigma_deg : standard deviation of the piece's direction, degrees
    """
    places = proposals(evidence, outline)
    handicap = _handicap(evidence.piece)
    chosen = _chosen(evidence, places, Noise(), handicap)
    noise = _background(evidence, chosen)
    chosen = _chosen(evidence, places, noise, handicap)
    found = []
    for u in places:
        weighed = weigh(evidence, u, _sides(evidence, [c for c in chosen if c != u], u), noise)
        log_odds = weighed.log_odds - handicap
        line = line_at(evidence.piece, outline, u)
        if line is not None and log_odds >= LEAST_LOG_ODDS:
            cut = _cut(evidence, u, line, (log_odds, weighed.step_m), aspect_sigma_deg)
            found.append(Candidate(u, log_odds, cut, weighed))
    return sorted(found, key=lambda c: (-c.log_odds, c.u))


def _handicap(piece: AxisPiece) -> float:
    """By how much less likely borders are across what is rather deep than long, or a short wing of a house."""
    if piece.depth > piece.chain_m:
        return CROSSWISE_ODDS
    return SHORT_WING_ODDS if piece.chain_m < SHORT_WING_M else 0.0


def proposals(evidence: PieceEvidence, outline: Polygon) -> list[float]:
    """Places of the maxima of the scan; the end of the piece too where another wing begins and one is near."""
    scores = score(evidence)
    total = _allowed(evidence.piece, outline, scores.total)
    found = [k for k in maxima(total, evidence.stations, APART_M) if total[k] > LEAST_SCORE]
    places = [place(evidence, scores, k) for k in found]
    ends = [float(evidence.stations[k]) for k in (0, -1) if np.isfinite(total[k])]
    ends = [e for e in ends if any(abs(p - e) < AT_END_M for p in places)]
    return sorted(dict.fromkeys(places + ends))


def _chosen(evidence: PieceEvidence, places: Sequence[float], noise: Noise, handicap: float) -> list[float]:
    """Borders that are likelier than not: each weighed alone, taken strongest first as long as it holds between those already there."""
    alone = [weigh(evidence, u, _sides(evidence, [], u), noise).log_odds - handicap for u in places]
    chosen: list[float] = []
    for k in sorted(range(len(places)), key=lambda k: (-alone[k], places[k])):
        if alone[k] <= 0:
            break
        if weigh(evidence, places[k], _sides(evidence, chosen, places[k]), noise).log_odds > handicap:
            chosen.append(places[k])
    return _settled(evidence, chosen, noise, handicap)


def _settled(evidence: PieceEvidence, chosen: Sequence[float], noise: Noise, handicap: float) -> list[float]:
    """Without those that do not hold between their final neighbours; the weakest goes first."""
    left = list(chosen)
    while left:
        odds = [weigh(evidence, u, _sides(evidence, [c for c in left if c != u], u), noise).log_odds for u in left]
        weakest = int(np.argmin(odds))
        if odds[weakest] > handicap:
            break
        left.pop(weakest)
    return sorted(left)


def _sides(evidence: PieceEvidence, chosen: Sequence[float], u: float) -> Sides:
    first, last = float(evidence.stations[0]) - CONTEXT_M, float(evidence.stations[-1]) + CONTEXT_M
    return Sides(max([c for c in chosen if c < u], default=first), min([c for c in chosen if c > u], default=last))


def _background(evidence: PieceEvidence, chosen: Sequence[float]) -> Noise:
    """What changes where there is no border: in the middle between those that were found, and beside it."""
    ends = [float(evidence.stations[0]), *chosen, float(evidence.stations[-1])]
    controls = [
        weigh(evidence, a + share * (b - a), Sides(a, b), Noise())
        for a, b in pairwise(ends)
        if b - a > 4.0
        for share in CONTROLS
    ]
    if len(controls) < 3:
        return Noise()
    plain = Noise()
    facades = [f for c in controls for f in c.facade_change]
    return Noise(
        max(plain.height_m, _middle([c.step_m for c in controls])),
        max(plain.roof, _middle([c.roof_change for c in controls])),
        max(plain.facade, _middle(facades)),
    )


def _middle(values: Sequence[float]) -> float:
    known = [v for v in values if np.isfinite(v)]
    return 1.2 * float(np.median(known)) if known else 0.0


def _cut(
    evidence: PieceEvidence, u: float, line: LineString, odds_and_step: tuple[float, float], sigma: float
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


def _allowed(piece: AxisPiece, outline: Polygon, total: FloatArray) -> FloatArray:
    """Without stations at free ends of a row."""
    allowed = total.copy()
    for end, inward in ((0, 1), (-1, -1)):
        u = piece.stations[end]
        middle = (piece.low[end] + piece.high[end]) / 2
        beyond = Point(piece.to_world(np.array([u - inward * 1.0, middle])))
        if not outline.contains(beyond):
            allowed[np.abs(piece.stations - u) < FREE_END_M] = -np.inf
    return allowed


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
