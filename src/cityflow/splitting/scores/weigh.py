"""One border weighed: what lies between it and its neighbours on the one side against what lies on the other.

Scanning slices finds where something changes; here a change has to last. Each side reaches from the border to the next one (or a few metres),
so an edge that only looks like a border because a stronger one is near falls away, and windows, dormers and chimneys are outvoted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.splitting.scores.border_sides import Sides
from cityflow.splitting.scores.facade_change import facade_change
from cityflow.splitting.scores.roof_change import SHADOW_HUE, SHADOWED, is_light, roof_change
from cityflow.splitting.scores.roof_step import RoofStep, roof_step
from cityflow.splitting.scores.score_height import VALLEY_SLOPE
from cityflow.splitting.strips.strip_evidence import StripEvidence

PRIOR = -5.0
"""Logarithm of the odds of a border where nothing is known."""
LEAST_SIDE_M = 2.0
"""No house is narrower."""
HEIGHT_FLOOR_M, ROOF_FLOOR, FACADE_FLOOR = 0.04, 0.03, 0.045
"""Usual size of changes where there is no border, at least."""
HEIGHT_MOST, ROOF_MOST, FACADE_MOST = 6.5, 6.0, 4.5
CLEAR = 3.0
"""A change of so many times its usual size gives 63 % of what its kind can give."""
SECOND_FACADE = 0.8
OTHER_QUIET = 1.5
ALONE, SUPPORT = -4.0, 2.0
"""One façade, or a roof that is brighter but of the same hue, is doubted where nothing else says the same; so much support ends most of the doubt."""
SLOPED_MOST, VERTICAL_MOST, COPLANAR = 2.0, 1.2, 2.2
PIPE_MOST, BOTH_PIPES = 2.6, 1.0
"""A pipe on one façade, and more where the other has one at the same place."""
SAME_SLOPE = 0.12
"""Roofs on both sides whose slopes along the axis differ by more are lit differently: their colours cannot be compared."""
BENT_NOISE = 2.5
"""By how much less a change of hue says where a roof bends."""
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
    facades = [facade_change(changes, u, sides) for changes in evidence.facades]
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
    change, hue, alike = roof_change(evidence, u, sides)
    level = float(np.exp(-((step.bend / SAME_SLOPE) ** 2)))
    of_colour = level * _saturating(change / noise, ROOF_MOST)
    of_hue = _saturating(hue / (BENT_NOISE * noise), ROOF_MOST)
    # what steps is no shadow
    shadow = _height_odds(step, HEIGHT_FLOOR_M) < 0.5 and is_light(evidence, u, sides, (change, hue))
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


def _facade_odds(facades: list[tuple[float, float]], noise: float) -> float:
    """Both façades together; a well-seen one that does not change at all speaks against the other."""
    low, high = sorted(sharp * _saturating(size / noise, FACADE_MOST) for size, sharp in facades)
    quiet = min((size for size, _ in facades if np.isfinite(size)), default=np.inf)
    against = OTHER_QUIET * np.exp(-((quiet / noise) ** 2)) if np.isfinite(facades[0][0] + facades[1][0]) else 0.0
    return float(max(high + SECOND_FACADE * low - against, 0.0)) if high > 0 else 0.0


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
