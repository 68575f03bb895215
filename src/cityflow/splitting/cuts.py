"""From evidence at stations to cut lines: maxima, their places to a fraction of a slice, lines across the outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import CutLine
from cityflow.splitting.piece_evidence import PieceEvidence, at_stations
from cityflow.splitting.score import Score, score
from cityflow.splitting.score_colour import DARK, Change
from cityflow.splitting.skeleton import AxisPiece
from cityflow.splitting.strip_images import CONTEXT_M
from cityflow.splitting.weigh import Noise, Sides, Weighed, bottom_of_valley, weigh

APART_M = 1.8
"""Maxima nearer to one another than this are one."""
REACH_M = 0.9
"""How far from its maximum the place of a border is looked for."""
TOGETHER_M = 0.3
"""Places that agree within this are averaged."""
FREE_END_M = 2.0
"""No border is nearer to a free end of a row."""
JUNCTION_M = 0.5
LEAST_SCORE = 1.2
"""Weaker maxima of the scan are no proposals."""
LEAST_LOG_ODDS = -3.0
"""Weaker borders are not even named among the rejected."""
CROSSWISE_ODDS, SHORT_WING_ODDS, SHORT_WING_M = 2.0, 1.5, 8.0
AT_END_M = 1.2
CORNER_M = 0.2
"""A border this near to a corner of the outline runs through it."""
BEYOND_M = 1.0
GRAZE_M = 0.06
OFF_CORNER_M = 0.01
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


def place(evidence: PieceEvidence, scores: Score, k: int) -> float:
    """The border near station k, from every source that changes there; robust mean of where each changes."""
    u_0 = float(evidence.stations[k])
    places = [(u_0, 0.05)]
    bottom = bottom_of_valley(evidence, u_0) if evidence.height.valley[k] > 0 else None
    if bottom is not None and abs(bottom - u_0) < REACH_M:
        places.append((bottom, 4.0))
    elif scores.height[k] > 1.0:
        places += _from_rows(evidence, k, 4.0)
    if evidence.roof_colour is not None and scores.roof[k] > 1.0:
        places += _from_colour(evidence.roof_colour, k, u_0, 3.0)
    for changes in evidence.facades:
        for change in changes:
            if at_stations(change.significance)[k] > 4.0:
                places += _from_colour(change, k, u_0, 2.0)
    places += _from_slices(evidence, k)
    return _agreed(places)


def _from_rows(evidence: PieceEvidence, k: int, weight: float) -> list[tuple[float, float]]:
    change = evidence.height
    before, after = _levels(change.rows, change.u, float(evidence.stations[k]))
    step = after - before
    clear = np.abs(step) > 0.1
    if clear.sum() < 3:
        return []
    share = (change.rows[:, clear] - (before + after)[clear] / 2) / step[clear]
    at = edge_position(np.clip(share, -0.5, 0.5), change.u, float(evidence.stations[k]))
    return [] if at is None else [(at, weight)]


def _levels(rows: FloatArray, u: FloatArray, at: float) -> tuple[FloatArray, FloatArray]:
    """Median height of every row shortly before and after a place."""
    before, after = (u > at - 1.6) & (u < at - 0.3), (u > at + 0.3) & (u < at + 1.6)
    return _median_rows(rows[before]), _median_rows(rows[after])


def _median_rows(rows: FloatArray) -> FloatArray:
    result = np.full(rows.shape[1], np.nan)
    known = np.isfinite(rows).sum(axis=0) > 0.5 * max(len(rows), 1)
    if len(rows):
        result[known] = np.nanmedian(rows[:, known], axis=0)
    return result


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


def _row_levels(part: FloatArray) -> FloatArray:
    """(Z, C) median over columns; NaN where hardly anything is known."""
    result = np.full(part.shape[1:], np.nan)
    known = np.isfinite(part[..., 0]).sum(axis=0) >= max(0.3 * len(part), 2)
    result[known] = np.nanmedian(part[:, known], axis=0)
    return result


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
    column[known] = np.nanmedian(part[known], axis=1)
    below = np.concatenate([[0.0], np.cumsum(column)])
    k = int(np.argmin(below))
    if k in (0, len(column)):
        return None
    cell = float(u[1] - u[0])
    # the columns beside the border are mixed: what they lack of a full half shifts it
    shift = (column[k - 1] + 0.5) - (0.5 - column[k])
    at = float(u[near][k] - cell / 2 - shift * cell)
    return at if abs(at - u_0) <= REACH_M else None


def _from_slices(evidence: PieceEvidence, k: int) -> list[tuple[float, float]]:
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


def line_at(piece: AxisPiece, outline: Polygon, u: float) -> LineString | None:
    """The chord at u, from border to border; at a corner of the outline where one is near, and never beyond the piece."""
    u = _at_corner(piece, outline, float(np.clip(u, piece.stations[0], piece.stations[-1])))
    near = np.abs(piece.stations - u) <= max(CORNER_M, 1.01 * float(piece.stations[1] - piece.stations[0]))
    low, high = float(piece.low[near].min()), float(piece.high[near].max())
    line = LineString(piece.to_world(np.array([[u, low - BEYOND_M], [u, high + BEYOND_M]])))
    middle = Point(piece.to_world(np.array([u, float(np.median(piece.low[near] + piece.high[near])) / 2])))
    parts = [p for p in shapely.get_parts(shapely.intersection(line, outline)) if isinstance(p, LineString)]
    chord = min(parts, key=middle.distance, default=None)
    return None if chord is None else _ending_at_corners(chord, outline)


def _ending_at_corners(chord: LineString, outline: Polygon) -> LineString:
    """The chord without ends that only graze a wall: it ends at the corner where that wall begins."""
    corners = _corners(outline)
    near = corners[shapely.distance(shapely.points(corners), chord) < GRAZE_M]
    ends = shapely.get_coordinates(chord)[[0, -1]]
    for k in (0, 1):
        along = (ends[1 - k] - ends[k]) / max(float(np.linalg.norm(ends[1 - k] - ends[k])), 1e-9)
        for corner in sorted(near.tolist(), key=lambda c: -float((np.array(c) - ends[k]) @ along)):
            rest = Point((np.array(corner) + ends[k]) / 2)
            beyond = float((np.array(corner) - ends[k]) @ along)
            if beyond < 0.5 * chord.length and outline.boundary.distance(rest) < 2 * GRAZE_M:
                ends[k] = corner
                break
    return LineString(ends)


def off_corners(line: LineString, outline: Polygon) -> LineString:
    """The line with ends that lie on corners moved a centimetre onto a wall: prolonged, it leaves the outline there."""
    ends = shapely.get_coordinates(line)[[0, -1]]
    along = (ends[1] - ends[0]) / max(line.length, 1e-9)
    aside = OFF_CORNER_M * np.array([-along[1], along[0]])
    corners, border = _corners(outline), outline.boundary
    for k in (0, 1):
        if np.hypot(*(corners - ends[k]).T).min() < 1e-6:
            ends[k] = min((ends[k] - aside, ends[k] + aside), key=lambda p: border.distance(Point(p)))
    return LineString(ends)


def _corners(outline: Polygon) -> FloatArray:
    """(n, 2) vertices of all rings."""
    return np.concatenate([shapely.get_coordinates(r)[:-1, :2] for r in (outline.exterior, *outline.interiors)])


def _at_corner(piece: AxisPiece, outline: Polygon, u: float) -> float:
    """u of the nearest corner of the outline that the line would pass within a hand's breadth, or u."""
    uv = piece.to_uv(_corners(outline))
    low, high = piece.ends_at(u)
    beside = (uv[:, 1] < high + CORNER_M) & (uv[:, 1] > low - CORNER_M)
    inner = uv[beside, 0]
    if not len(inner):
        return u
    nearest = float(inner[int(np.argmin(np.abs(inner - u)))])
    return nearest if abs(nearest - u) < CORNER_M else u
