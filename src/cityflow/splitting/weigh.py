"""One border weighed: what lies between it and its neighbours on the one side against what lies on the other.

Scanning slices finds where something changes; here a change has to last. Each side reaches from the border to the next one (or a few metres),
so an edge that only looks like a border because a stronger one is near falls away, and windows, dormers and chimneys are outvoted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.splitting.roof_step import RoofStep, roof_step
from cityflow.splitting.running_median import block_medians
from cityflow.splitting.score_colour import BANDS, DARK, Change
from cityflow.splitting.score_height import VALLEY_SLOPE
from cityflow.splitting.strip_evidence import StripEvidence

PRIOR = -5.0
"""Logarithm of the odds of a border where nothing is known."""
LEAST_SIDE_M = 2.0
"""No house is narrower."""
ROOF_SIDE_M, FACADE_SIDE_M = 3.0, 4.0
FACADE_LASTS_M = 8.0
"""A change of a façade that is gone over this length was a bay, a staircase or a stack of balconies."""
ROOF_GUARD_M, FACADE_GUARD_M = 0.16, 0.2
HEIGHT_FLOOR_M, ROOF_FLOOR, FACADE_FLOOR = 0.04, 0.03, 0.045
"""Usual size of changes where there is no border, at least."""
HEIGHT_MOST, ROOF_MOST, FACADE_MOST = 6.5, 6.0, 4.5
CLEAR = 3.0
"""A change of so many times its usual size gives 63 % of what its kind can give."""
SECOND_FACADE = 0.8
OTHER_QUIET = 1.5
ROWS_KNOWN, FACADE_TRUSTED = 0.15, (0.1, 0.4)
"""Share of a row's cells that must be known on either side for it to be compared; share of the façade's rows that are, below
the first of which the façade says nothing, above the second all it can."""
ALONE, SUPPORT = -4.0, 2.0
"""One façade, or a roof that is brighter but of the same hue, is doubted where nothing else says the same; so much support ends most of the doubt."""
SLOPED_MOST, VERTICAL_MOST, COPLANAR = 2.0, 1.2, 2.2
PIPE_MOST, BOTH_PIPES = 2.6, 1.0
"""A pipe on one façade, and more where the other has one at the same place."""
SAME_SLOPE = 0.12
"""Roofs on both sides whose slopes along the axis differ by more are lit differently: their colours cannot be compared."""
BENT_NOISE = 2.5
"""By how much less a change of hue says where a roof bends."""
SHARP_M, SHARP_GUARD_M = 1.2, 0.2
SHARP_SHARE = (0.35, 0.65)
"""Share of a façade's height at which its colour changes just there: below the first it does not count, above the second wholly."""
ROOF_SHARP_M, ROOF_SHARP_GUARD_M = 1.2, 0.3
LIGHT_LEAST, SEAM_APART = 0.06, 0.4
"""Change of a roof from which it may be a seam of the mosaic: there roof and ground differ, band by band, by a small share of the change."""
SHADOW_LEAST, SHADOW_SIDE_M, SHADOWED, SHADOW_HUE = 0.15, 1.5, 0.15, 0.35
"""Change of a roof from which it may be a shadow's; how far along the ground it is looked for; what is left of its weight;
share of the change that may be one of hue."""
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


def weigh(evidence: StripEvidence, u: float, sides: Sides, noise: Noise) -> Weighed:
    """Weigh a border at u."""
    if min(u - sides.left, sides.right - u) < LEAST_SIDE_M:
        return Weighed(-np.inf, 0.0, 0.0, 0.0, 0.0, 0.0, np.nan, (np.nan, np.nan))
    step = roof_step(evidence, u, (sides.left, sides.right))
    height = _height_odds(step, noise.height_m) + _valley_odds(step, evidence.roof_colour is None)
    roof, roof_change, shadow, plain = _roof_odds(evidence, u, sides, step, noise.roof)
    facades = [_facade_change(changes, u, sides) for changes in evidence.facades]
    # what a shadow does to roof and ground it does to walls and to edges found in pictures
    facade = _facade_odds(facades, noise.facade) * (SHADOWED if shadow else 1.0)
    segments = _segment_odds(evidence, u) * (SHADOWED if shadow else 1.0)
    doubt = _alone(facades, (height, segments), roof, plain, noise)
    if evidence.roof_colour is not None and step.size > STOREY_M and roof < 1.5 and facade < 1.5:
        # the step explains the edges along it
        segments = SAME_COLOURS
    total = PRIOR + height + roof + facade + segments + doubt + _doubt(step) + _narrow(sides, u)
    return Weighed(total, step.size, height, roof, facade, segments, roof_change, (facades[0][0], facades[1][0]))


def _roof_odds(
    evidence: StripEvidence, u: float, sides: Sides, step: RoofStep, noise: float
) -> tuple[float, float, bool, bool]:
    """What the roof's colour adds, by how much it changes, whether that is the edge of a shadow or a seam, and whether the hue stays."""
    change, hue, alike = _roof_change(evidence, u, sides)
    level = float(np.exp(-((step.bend / SAME_SLOPE) ** 2)))
    of_colour = level * _saturating(change / noise, ROOF_MOST)
    of_hue = _saturating(hue / (BENT_NOISE * noise), ROOF_MOST)
    # what steps is no shadow
    shadow = _height_odds(step, HEIGHT_FLOOR_M) < 0.5 and _is_light(evidence, u, sides, (change, hue))
    plain = not hue > SHADOW_HUE * change
    return (SHADOWED if shadow else 1.0) * alike**2 * max(of_colour, of_hue), change, shadow, plain


def _alone(
    facades: list[tuple[float, float]], others: tuple[float, float], of_roof: float, plain: bool, noise: Noise
) -> float:
    """Doubt where one façade, or a mere difference of brightness of the roof, is all that speaks for a border."""
    low, high = sorted(sharp * _saturating(size / noise.facade, FACADE_MOST) for size, sharp in facades)
    parts = sorted([*others, of_roof, low, high])
    if max(others) >= parts[-1] or (of_roof >= parts[-1] and not plain):
        return 0.0
    return float(ALONE * np.exp(-((max(sum(parts[:-1]), 0.0) / SUPPORT) ** 2)))


def _saturating(clear: float, most: float) -> float:
    return float(most * (1 - np.exp(-((clear / CLEAR) ** 2)))) if np.isfinite(clear) else 0.0


def _height_odds(step: RoofStep, noise: float) -> float:
    """The median part of the depth counts, and the share of parts that step clearly."""
    if not len(step.groups):
        return 0.0
    usual = float(np.hypot(noise, 1.5 * step.unrest))
    share = float((np.abs(step.groups) > max(0.08, 2 * usual)).mean())
    return _saturating(step.size / usual, HEIGHT_MOST) * share**2


def _valley_odds(step: RoofStep, alone: bool) -> float:
    """Houses whose gables stand side by side meet in valleys; without colours that is most of what tells."""
    steep = min(-step.before, step.after)
    if steep < VALLEY_SLOPE:
        return 0.0
    return float(min(steep / STEEP_VALLEY, 1.0)) * (VALLEY_ALONE if alone else VALLEY_MOST)


def _roof_change(evidence: StripEvidence, u: float, sides: Sides) -> tuple[float, float, float]:
    """Relative change of the roof's colour, median over bands along the axis; of its hue; share of bands that agree with it."""
    change = evidence.roof_colour
    if change is None:
        return float("nan"), float("nan"), 0.0
    inside = np.atleast_1d(np.isfinite(change.image[..., 0]).any(axis=0))
    first, last = int(np.argmax(inside)), len(inside) - int(np.argmax(inside[::-1]))
    edges = np.linspace(first, last, BANDS + 1).round().astype(np.int64)
    ratio = _ratio(change, u, sides, edges, (ROOF_SIDE_M, ROOF_GUARD_M))
    known = np.isfinite(ratio).all(axis=1)
    if known.sum() < BANDS // 2:
        return float("nan"), float("nan"), 0.0
    median = np.median(ratio[known], axis=0)
    size, hue = float(np.abs(median).max()), float(np.abs(median - median.mean()).max())
    alike = float((ratio[known] @ median > 0.4 * float(median @ median)).mean())
    # an edge that runs askew, or fades, is no border at this place
    near = _ratio(change, u, sides, edges, (ROOF_SHARP_M, ROOF_SHARP_GUARD_M))
    near = near[np.isfinite(near).all(axis=1)]
    sharp = _share_of(near, median) if len(near) >= BANDS // 2 else 1.0
    return size, hue, alike * float(np.sqrt(sharp))


def _is_light(evidence: StripEvidence, u: float, sides: Sides, change: tuple[float, float]) -> bool:
    """True where the ground beside the house darkens or brightens as the roof does: the edge of a shadow, which leaves hues alone, or a seam
    between pictures of two exposures, which changes the hues of both alike."""
    size, hue = change
    colour = evidence.roof_colour
    if colour is None or not size > LIGHT_LEAST:
        return False
    v, at = evidence.roof.v, evidence.roof.u
    inside = np.flatnonzero(np.atleast_1d(np.isfinite(colour.image[..., 0]).any(axis=0)))
    edges = np.array([inside[0], inside[-1] + 1], np.int64)
    roof = _ratio(colour, u, sides, edges, (ROOF_SIDE_M, ROOF_GUARD_M))[0]
    low, high = evidence.strip.ends_at(u)
    columns = [(at > u - SHADOW_SIDE_M) & (at < u - 0.2), (at < u + SHADOW_SIDE_M) & (at > u + 0.2)]
    for beside in (v < low - 0.6, v > high + 0.6):
        before, after = (evidence.roof.around[np.ix_(c, beside)].reshape(-1, colour.image.shape[2]) for c in columns)
        before, after = (p[np.isfinite(p).all(axis=1)] for p in (before, after))
        if min(len(before), len(after)) < 20:
            continue
        a, b = np.median(before, axis=0), np.median(after, axis=0)
        ground = (b - a) / (0.5 * (a + b) + DARK)
        if _same_light(roof, ground, (size, hue)):
            return True
    return False


def _same_light(roof: FloatArray, ground: FloatArray, change: tuple[float, float]) -> bool:
    """Whether roof and ground change as one: by a shadow, or band by band by a seam."""
    size, hue = change
    mean = float(roof.mean())
    neutral = hue < SHADOW_HUE * size and float(np.abs(ground - ground.mean()).max()) < SHADOW_HUE * size
    shadow = (
        neutral and size > SHADOW_LEAST and 0.6 * abs(mean) < float(ground.mean()) * np.sign(mean) < 1.6 * abs(mean)
    )
    return bool(shadow or np.abs(ground - roof).max() < SEAM_APART * size)


def _facade_odds(facades: list[tuple[float, float]], noise: float) -> float:
    """Both façades together; a well-seen one that does not change at all speaks against the other."""
    low, high = sorted(sharp * _saturating(size / noise, FACADE_MOST) for size, sharp in facades)
    quiet = min((size for size, _ in facades if np.isfinite(size)), default=np.inf)
    against = OTHER_QUIET * np.exp(-((quiet / noise) ** 2)) if np.isfinite(facades[0][0] + facades[1][0]) else 0.0
    return float(max(high + SECOND_FACADE * low - against, 0.0)) if high > 0 else 0.0


def _facade_change(changes: tuple[Change, ...], u: float, sides: Sides) -> tuple[float, float]:
    """Relative change of a façade's colour in the local frame that shows most of it, and how much that counts, 0 to 1: where it is sharp,
    lasts, and enough of the façade is known on both sides."""
    if not changes:
        return float("nan"), 0.0
    best = max(changes, key=lambda c: c.seen)
    rows, trust = _rows_of_both(best, u, sides)
    if trust <= 0:
        return float("nan"), 0.0
    part = replace(best, image=np.ascontiguousarray(best.image[:, rows]))
    edges = np.array([0, part.image.shape[1]], np.int64)
    ratio = _ratio(part, u, sides, edges, (FACADE_SIDE_M, FACADE_GUARD_M))[0]
    if not np.isfinite(ratio).all():
        return float("nan"), 0.0
    far = _ratio(part, u, sides, edges, (FACADE_LASTS_M, FACADE_GUARD_M))[0]
    left = float(far @ ratio) / max(float(ratio @ ratio), 1e-9) if np.isfinite(far).all() else 1.0
    return float(np.abs(ratio).max()), trust * _most(left) * _sharp(part, u, ratio)


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
    return _share_of(near[known], ratio)


def _share_of(near: FloatArray, ratio: FloatArray) -> float:
    """How many of some changes, one a line, go the way of the whole: 0 for few, 1 for most."""
    return _most(float((near @ ratio > 0.5 * float(ratio @ ratio)).mean()))


def _most(share: float) -> float:
    return float(np.clip((share - SHARP_SHARE[0]) / (SHARP_SHARE[1] - SHARP_SHARE[0]), 0, 1))


def _row_means(part: Float32Array) -> FloatArray:
    """(Z, C) means over columns of what is known."""
    known = np.isfinite(part)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(known, part, 0).sum(axis=0, dtype=np.float64) / known.sum(axis=0))


def _ratio(change: Change, u: float, sides: Sides, edges: np.ndarray, reach: tuple[float, float]) -> FloatArray:
    """(B, C) relative change from before to after."""
    at, (side, guard) = change.u, reach
    before = np.searchsorted(at, [max(sides.left + guard, u - side), u - guard])
    after = np.searchsorted(at, [u + guard, min(sides.right - guard, u + side)])
    if before[1] - before[0] < 2 or after[1] - after[0] < 2:
        return np.full((len(edges) - 1, change.image.shape[2]), np.nan)
    low = block_medians(change.image, (int(before[0]), int(before[1])), edges, 0.1).astype(np.float64)
    high = block_medians(change.image, (int(after[0]), int(after[1])), edges, 0.1).astype(np.float64)
    return np.asarray((high - low) / (0.5 * (high + low) + DARK))


def _segment_odds(evidence: StripEvidence, u: float) -> float:
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


def _doubt(step: RoofStep) -> float:
    """What looks like a border and is a part of one building: a ridge, a saw-tooth."""
    doubt = 0.0
    if min(step.before, -step.after) > RIDGE_SLOPE:
        doubt += ON_RIDGE
    alike = min(abs(step.before), abs(step.after)) > 0.08 and step.bend < 0.3 * max(abs(step.before), abs(step.after))
    if alike and step.size > 0.5 and step.before * step.signed < 0:
        doubt += SAW_TOOTH
    return doubt
