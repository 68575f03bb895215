"""One border weighed: what lies between it and its neighbours on the one side against what lies on the other.

Scanning slices finds where something changes; here a change has to last. Each side reaches from the border to the next one (or a few metres),
so an edge that only looks like a border because a stronger one is near falls away, and windows, dormers and chimneys are outvoted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.splitting.piece_evidence import PieceEvidence
from cityflow.splitting.running_median import block_medians
from cityflow.splitting.score_colour import BANDS, DARK, Change
from cityflow.splitting.score_height import VALLEY_SLOPE

PRIOR = -5.0
"""Logarithm of the odds of a border where nothing is known."""
LEAST_SIDE_M = 2.0
"""No house is narrower."""
HEIGHT_SIDE_M, ROOF_SIDE_M, FACADE_SIDE_M = 2.5, 3.0, 4.0
HEIGHT_GUARD_M, ROOF_GUARD_M, FACADE_GUARD_M = 0.25, 0.16, 0.2
HEIGHT_FLOOR_M, ROOF_FLOOR, FACADE_FLOOR = 0.04, 0.03, 0.045
"""Usual size of changes where there is no border, at least."""
HEIGHT_MOST, ROOF_MOST, FACADE_MOST = 6.5, 6.0, 4.5
CLEAR = 3.0
"""A change of so many times its usual size gives 63 % of what its kind can give."""
SECOND_FACADE = 0.8
OTHER_QUIET = 1.5
SLOPED_MOST, VERTICAL_MOST, COPLANAR = 2.0, 1.2, 2.2
PIPE_MOST, BOTH_PIPES = 2.6, 1.0
"""A pipe on one façade, and more where the other has one at the same place."""
SAME_SLOPE = 0.12
"""Roofs on both sides whose slopes along the axis differ by more are lit differently: their colours cannot be compared."""
RIDGE_M, BEND_M = 0.8, 0.4
"""A ridge, or another bend of the roof, may be this far from the place in question."""
BENT_NOISE = 2.5
"""By how much less a change of hue says where a roof bends."""
SHARP_M, SHARP_GUARD_M = 1.2, 0.2
SHARP_SHARE = (0.35, 0.65)
"""Share of a façade's height at which its colour changes just there: below the first it does not count, above the second wholly."""
STOREY_M = 2.3
RIDGE_SLOPE = 0.15
STEEP_VALLEY, VALLEY_MOST, VALLEY_ALONE = 0.5, 3.0, 6.0
SAME_COLOURS, SAW_TOOTH, ON_RIDGE = -4.5, -8.0, -3.0
USUAL_WIDTH_M, NARROW = 4.5, -2.5


@dataclass(frozen=True, slots=True)
class Noise:
    """Usual size of changes where there is no border: metres, and relative changes of colour."""

    height_m: float = HEIGHT_FLOOR_M
    roof: float = ROOF_FLOOR
    facade: float = FACADE_FLOOR


@dataclass(frozen=True, slots=True)
class Sides:
    """How far one may look before and after a border: u of the neighbouring borders, metres."""

    left: float
    right: float


@dataclass(frozen=True, slots=True)
class Weighed:
    """A border and what speaks for it.

    Attributes
    ----------
    log_odds : logarithm of its odds
    step_m : how much the roofs differ, metres
    height, roof, facade, segments : what each kind adds to the logarithm
    roof_change, facade_change : relative changes of colour, the latter of both sides; NaN where unknown
    """

    log_odds: float
    step_m: float
    height: float
    roof: float
    facade: float
    segments: float
    roof_change: float
    facade_change: tuple[float, float]


def weigh(evidence: PieceEvidence, u: float, sides: Sides, noise: Noise) -> Weighed:
    """Weigh a border at u."""
    if min(u - sides.left, sides.right - u) < LEAST_SIDE_M:
        return Weighed(-np.inf, 0.0, 0.0, 0.0, 0.0, 0.0, np.nan, (np.nan, np.nan))
    step = _step(evidence, u, sides)
    height = _height_odds(step, noise.height_m) + _valley_odds(step, evidence.roof_colour is None)
    roof_change, hue, alike = _roof_change(evidence, u, sides)
    level = float(np.exp(-((step.bend / SAME_SLOPE) ** 2)))
    roof = alike**2 * max(
        level * _saturating(roof_change / noise.roof, ROOF_MOST),
        _saturating(hue / (BENT_NOISE * noise.roof), ROOF_MOST),
    )
    facades = [_facade_change(changes, u, sides) for changes in evidence.facades]
    facade = _facade_odds(facades, noise.facade)
    segments = _segment_odds(evidence, u)
    total = PRIOR + height + roof + facade + segments + _doubt(evidence, step, roof, facade) + _narrow(sides, u)
    return Weighed(total, step.size, height, roof, facade, segments, roof_change, (facades[0][0], facades[1][0]))


def _saturating(clear: float, most: float) -> float:
    return float(most * (1 - np.exp(-((clear / CLEAR) ** 2)))) if np.isfinite(clear) else 0.0


@dataclass(frozen=True, slots=True)
class _Step:
    """Size (m) and share of the depth of a step; its sign; slopes along the axis on both sides, and how much they differ; unrest (m)."""

    size: float
    groups: FloatArray
    unrest: float
    signed: float
    before: float
    after: float

    @property
    def bend(self) -> float:
        return abs(self.after - self.before) if np.isfinite(self.after - self.before) else 0.0


def _step(evidence: PieceEvidence, u: float, sides: Sides) -> _Step:
    rows, at = evidence.height.rows, evidence.height.u
    guard = max(HEIGHT_GUARD_M, 1.5 * float(at[1] - at[0]))
    before = _lines(rows, at, (at > max(sides.left + guard, u - HEIGHT_SIDE_M)) & (at < u - guard), u)
    after = _lines(rows, at, (at < min(sides.right - guard, u + HEIGHT_SIDE_M)) & (at > u + guard), u)
    difference = _apart(after[0] - before[0], before[1], after[1])
    known = np.flatnonzero(np.isfinite(difference))
    if len(known) < max(3, 0.3 * rows.shape[1]):
        return _Step(0.0, np.zeros(0), 0.0, 0.0, 0.0, 0.0)
    groups = np.array([np.median(difference[g]) for g in np.array_split(known, min(4, len(known)))])
    unrest = float(np.median(np.maximum(before[2], after[2])[known]))
    return _Step(
        float(np.median(np.abs(groups))), groups, unrest, float(np.median(difference[known])),
        float(np.median(before[1][known])), float(np.median(after[1][known])),
    )  # fmt: skip


def bottom_of_valley(evidence: PieceEvidence, u: float) -> float | None:
    """Where the roofs before and after u meet, median over the depth; None where they do not both fall towards it, nearby."""
    rows, at = evidence.height.rows, evidence.height.u
    guard = max(HEIGHT_GUARD_M, 1.5 * float(at[1] - at[0]))
    before = _lines(rows, at, (at > u - HEIGHT_SIDE_M) & (at < u - guard), u)
    after = _lines(rows, at, (at < u + HEIGHT_SIDE_M) & (at > u + guard), u)
    valley = (before[1] < -VALLEY_SLOPE) & (after[1] > VALLEY_SLOPE)
    if valley.sum() < max(3, 0.4 * rows.shape[1]):
        return None
    return u + float(np.median((before[0] - after[0])[valley] / (after[1] - before[1])[valley]))


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
    ordered = np.sort(np.where(known, off, np.inf), axis=0)
    middle = np.take_along_axis(ordered, np.maximum(known.sum(axis=0) - 1, 0)[None] // 2, axis=0)[0]
    return np.where(np.isfinite(middle), middle, 0.0)


def _fit(x: FloatArray, z: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted lines through columns of z: values at x = 0 and slopes; short windows lean towards level lines."""
    n, s_x, s_z = weight.sum(axis=0), x @ weight, (weight * z).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_x, mean_z = s_x / n, s_z / n
        s_xx = (x**2) @ weight - n * mean_x**2
        slope = (x @ (weight * z) - n * mean_x * mean_z) / (s_xx + 1e-9)
    return mean_z - slope * mean_x, slope


def _height_odds(step: _Step, noise: float) -> float:
    """The median part of the depth counts, and the share of parts that step clearly."""
    if not len(step.groups):
        return 0.0
    usual = float(np.hypot(noise, 1.5 * step.unrest))
    share = float((np.abs(step.groups) > max(0.08, 2 * usual)).mean())
    return _saturating(step.size / usual, HEIGHT_MOST) * share**2


def _valley_odds(step: _Step, alone: bool) -> float:
    """Houses whose gables stand side by side meet in valleys; without colours that is most of what tells."""
    steep = min(-step.before, step.after)
    if steep < VALLEY_SLOPE:
        return 0.0
    return float(min(steep / STEEP_VALLEY, 1.0)) * (VALLEY_ALONE if alone else VALLEY_MOST)


def _roof_change(evidence: PieceEvidence, u: float, sides: Sides) -> tuple[float, float, float]:
    """Relative change of the roof's colour, median over bands along the axis; of its hue; share of bands that agree with it."""
    change = evidence.roof_colour
    if change is None:
        return float("nan"), float("nan"), 0.0
    inside = np.isfinite(change.image[..., 0]).any(axis=0)
    first, last = int(np.argmax(inside)), len(inside) - int(np.argmax(inside[::-1]))
    edges = np.linspace(first, last, BANDS + 1).round().astype(np.int64)
    ratio = _ratio(change, u, sides, edges, (ROOF_SIDE_M, ROOF_GUARD_M))
    known = np.isfinite(ratio).all(axis=1)
    if known.sum() < BANDS // 2:
        return float("nan"), float("nan"), 0.0
    median = np.median(ratio[known], axis=0)
    size, hue = float(np.abs(median).max()), float(np.abs(median - median.mean()).max())
    return size, hue, float((ratio[known] @ median > 0.4 * float(median @ median)).mean())


def _facade_odds(facades: list[tuple[float, float]], noise: float) -> float:
    """Both façades together; a well-seen one that does not change at all speaks against the other."""
    low, high = sorted(sharp * _saturating(size / noise, FACADE_MOST) for size, sharp in facades)
    quiet = min((size for size, _ in facades if np.isfinite(size)), default=np.inf)
    against = OTHER_QUIET * np.exp(-((quiet / noise) ** 2)) if np.isfinite(facades[0][0] + facades[1][0]) else 0.0
    return float(max(high + SECOND_FACADE * low - against, 0.0)) if high > 0 else 0.0


def _facade_change(changes: tuple[Change, ...], u: float, sides: Sides) -> tuple[float, float]:
    """Relative change of a façade's colour in the frame that shows most of it, and how sharp it is, 0 to 1."""
    if not changes:
        return float("nan"), 0.0
    best = max(changes, key=lambda c: c.seen)
    edges = np.array([0, best.image.shape[1]], np.int64)
    ratio = _ratio(best, u, sides, edges, (FACADE_SIDE_M, FACADE_GUARD_M))[0]
    if not np.isfinite(ratio).all():
        return float("nan"), 0.0
    return float(np.abs(ratio).max()), _sharp(best, u, ratio)


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
    share = float((near[known] @ ratio > 0.5 * float(ratio @ ratio)).mean())
    return float(np.clip((share - SHARP_SHARE[0]) / (SHARP_SHARE[1] - SHARP_SHARE[0]), 0, 1))


def _row_means(part: Float32Array) -> FloatArray:
    """(Z, C) means over columns of what is known."""
    known = np.isfinite(part)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(known, part, 0).sum(axis=0, dtype=np.float64) / known.sum(axis=0))


def _ratio(
    change: Change, u: float, sides: Sides, edges: np.ndarray, reach: tuple[float, float]
) -> FloatArray:
    """(B, C) relative change from before to after."""
    at, (side, guard) = change.u, reach
    before = np.searchsorted(at, [max(sides.left + guard, u - side), u - guard])
    after = np.searchsorted(at, [u + guard, min(sides.right - guard, u + side)])
    if before[1] - before[0] < 2 or after[1] - after[0] < 2:
        return np.full((len(edges) - 1, change.image.shape[2]), np.nan)
    low = block_medians(change.image, (int(before[0]), int(before[1])), edges, 0.1).astype(np.float64)
    high = block_medians(change.image, (int(after[0]), int(after[1])), edges, 0.1).astype(np.float64)
    return np.asarray((high - low) / (0.5 * (high + low) + DARK))


def _segment_odds(evidence: PieceEvidence, u: float) -> float:
    slices = evidence.slices
    near = np.abs(evidence.stations - u) < 0.25
    if not near.any():
        return 0.0
    vertical = np.clip((slices.vertical[near].max(axis=0) - 0.3) / 0.5, 0, 1)
    sloped = float(np.clip((slices.sloped[near].max() - 0.35) / 0.4, 0, 1))
    coplanar = min(float(vertical.max()), sloped)
    pipes = np.array([_saturating(s, PIPE_MOST) for s in evidence.stripes[near].max(axis=0)])
    stripe = float(pipes.sum()) + (BOTH_PIPES if pipes.min() > 0.6 * PIPE_MOST else 0.0)
    return float(SLOPED_MOST * sloped + VERTICAL_MOST * vertical.sum() + COPLANAR * coplanar) + stripe


def _narrow(sides: Sides, u: float) -> float:
    """Less likely the narrower the house between this border and the next would be."""
    width = min(u - sides.left, sides.right - u)
    return NARROW * float(np.clip((USUAL_WIDTH_M - width) / (USUAL_WIDTH_M - LEAST_SIDE_M), 0, 1))


def _doubt(evidence: PieceEvidence, step: _Step, roof: float, facade: float) -> float:
    """What looks like a border and is a part of one building: a step of storeys with the same colours, a saw-tooth."""
    doubt = 0.0
    if evidence.roof_colour is not None and step.size > STOREY_M and roof < 1.5 and facade < 1.5:
        doubt += SAME_COLOURS
    if min(step.before, -step.after) > RIDGE_SLOPE:
        doubt += ON_RIDGE
    alike = min(abs(step.before), abs(step.after)) > 0.08 and step.bend < 0.3 * max(abs(step.before), abs(step.after))
    if alike and step.size > 0.5 and step.before * step.signed < 0:
        doubt += SAW_TOOTH
    return doubt
