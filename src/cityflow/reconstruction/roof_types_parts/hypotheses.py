"""Every roof type tried on one part of an outline: constructed, fitted to heights and lines, with its cost.

The ridge is sought first, with gabled ends; then each end on its own becomes a hip or a half-hip where that costs less.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.roof_type_names import RoofType
from cityflow.reconstruction.roof_types_parts import skeletons
from cityflow.reconstruction.roof_types_parts.hypothesis import (
    MANSARD_DEG,
    MANSARD_RATIO,
    MANSARD_RUN_M,
    OFF_MIDDLE,
    OFF_MIDDLE_COST,
    SHED_COST,
    STEEPEST_END,
    Hypothesis,
    HypothesisParameters,
    PartClues,
    end_cost,
    least_rise,
    measured_roof,
    minimised,
)
from cityflow.reconstruction.roof_types_parts.pointed_roofs import pyramid, sawtooths
from cityflow.reconstruction.roof_types_parts.shape_fit import Clues
from cityflow.reconstruction.roof_types_parts.skeletons import BEND, BEND_T, D0, D1, R2, R3, S2, S3, Quad, Skeleton

UNLIKELY = 2.0
"""Cost of what houses rarely have: ends of different kind, ridges across the longer side; set by hand."""


def hypotheses(clues: Clues, quad: Quad, parameters: HypothesisParameters) -> list[Hypothesis]:
    """All types over one part, cheapest first."""
    found = flat_and_sheds(clues, quad)
    longer = quad if quad.length >= quad.width else quad.turned()
    for k, turned in enumerate((longer, longer.turned())):
        part = PartClues(clues, turned)
        ratio = turned.length / turned.width
        across = UNLIKELY * min(1.0, max(0.0, 4 * (1 / ratio - 1.1))) if k else 0.0
        found += [h.dearer(across) for h in ridge_roofs(part, parameters)]
        found += sawtooths(part, parameters)
    found += [pyramid(PartClues(clues, longer))]
    return sorted((h for h in found if math.isfinite(h.cost)), key=lambda h: h.cost)


def wing_hypotheses(
    clues: Clues, joined: Quad, own: Quad, slope: float, parameters: HypothesisParameters
) -> list[tuple[Hypothesis, bool]]:
    """Types of a wing, and whether each runs on into the part that it leans on.

    Parameters
    ----------
    clues : of the cells beside that part
    joined : sides of the wing, the left one at the ridge that it runs into
    own : sides of what stands beside
    slope : of the part that it leans on, which wings often share; NaN where it has none
    """
    alone = flat_and_sheds(clues, own)
    alone += ridge_roofs(PartClues(clues, own.turned()), parameters, (False, False))
    inside = ridge_roofs(PartClues(clues, joined), parameters, (False, True))
    if slope > 0:
        alike = ridge_roofs(PartClues(clues, joined, slope), parameters, (False, True))
        inside += [h.dearer(-clues.per_parameter()) for h in alike]
    found = [(h, False) for h in alone] + [(h, True) for h in inside]
    return sorted(
        (f for f in found if f[0].skeleton.rise >= 0 or f[0].skeleton.type is RoofType.SHED), key=lambda f: f[0].cost
    )


def round_roofs(clues: Clues, quad: Quad, lines: FloatArray) -> list[Hypothesis]:
    """Level roof, cone and dome over an outline of many sides (K, 3), about round."""
    found = [h for h in flat_and_sheds(clues, quad) if h.skeleton.type is RoofType.FLAT]
    reach = lines[:, :2] @ quad.middle - lines[:, 2]
    rim, shape = lines / reach[:, None], skeletons.ridge_shape(quad)
    for kind in (RoofType.CONE, RoofType.DOME):
        t = skeletons.round_heights(clues.cells.xy, rim, kind is RoofType.DOME)
        cost, eave, rise = PartClues(clues, quad).of_heights(t)
        if rise >= least_rise(quad.width / 2):
            skeleton = Skeleton(kind, quad, shape, eave, rise, rim=rim)
            found.append(Hypothesis(skeleton, cost).dearer(clues.per_parameter()))
    return sorted(found, key=lambda h: h.cost)


def flat_and_sheds(clues: Clues, quad: Quad) -> list[Hypothesis]:
    part = PartClues(clues, quad)
    cost, eave, _ = part.of_heights(np.zeros(len(part.d)))
    shape = skeletons.ridge_shape(quad)
    found = [Hypothesis(Skeleton(RoofType.FLAT, quad, shape, eave, 0.0), cost)]
    for turned in (quad, quad.turned()):
        own = PartClues(clues, turned)
        cost, eave, rise = own.of_heights(own.d[:, 0] / turned.width)
        skeleton = Skeleton(RoofType.SHED, turned, shape, eave, rise)
        if abs(rise) >= least_rise(turned.width):
            found.append(Hypothesis(skeleton, cost).dearer(2 * clues.per_parameter() + SHED_COST))
    return found


def ridge_roofs(
    part: PartClues, parameters: HypothesisParameters, free: tuple[bool, bool] = (True, True)
) -> list[Hypothesis]:
    """Gable, hip, half-hip, mansard, butterfly with the ridge along the part; ends that are not free are gables."""
    found: list[Hypothesis] = []
    for base, paid in _ridges(part):
        gable = measured_roof(part, base, paid)
        rare = parameters.rare_cost if gable.skeleton.rise < 0 else 0.0
        found.append(gable.dearer(rare))
        if gable.skeleton.rise > 0:
            found += _with_ends(part, base, paid) if all(free) else []
            found += _with_end(part, base, paid) if free == (False, True) else []
    best = min(found, key=lambda h: h.cost)
    if best.skeleton.rise > 0:
        found += _mansards(part, best, parameters)
    # Runs that nearly meet leave a ridge of centimetres: `pyramid` has its faces meet exactly.
    ridged = [h for h in found if h.skeleton.type is not RoofType.PYRAMID]
    return [h for h in ridged if abs(h.skeleton.rise) >= least_rise(part.quad.width / 2)]


def _ridges(part: PartClues) -> list[tuple[FloatArray, float]]:
    """Gables with the ridge in the middle, and at the best place off it; each with what it has to pay."""
    each, width = part.clues.per_parameter(), part.quad.width
    middle = skeletons.ridge_shape(part.quad)
    reach = OFF_MIDDLE * width

    def cost(x: FloatArray) -> float:
        return part.of_shape(skeletons.ridge_shape(part.quad, 0.5 + x[0] / width))[0]

    starts = [np.array([x]) for x in (*_line_places(part, reach), 0.0)]
    best = min((minimised(cost, x, (np.array([-reach]), np.array([reach]))) for x in starts), key=lambda b: b[1])
    off = skeletons.ridge_shape(part.quad, 0.5 + best[0][0] / width)
    return [(middle, each), (off, 2 * each + OFF_MIDDLE_COST)]


def _line_places(part: PartClues, reach: float) -> list[float]:
    """Where lines run along the part, as offsets from the middle; the longest three."""
    segments, along = part.clues.segments, part.quad.direction
    if len(segments) == 0:
        return []
    step = segments[:, 2:] - segments[:, :2]
    length = np.hypot(*step.T)
    middle = (segments[:, :2] + segments[:, 2:]) / 2
    d = part.quad.distances(middle)
    offset = (d[:, 0] - d[:, 1]) / 2
    inside = (d[:, 2] > 0) & (d[:, 3] > 0) & (np.abs(offset) <= reach)
    chosen = inside & (np.abs(step @ along) > math.cos(math.radians(9.0)) * length) & (length > 0.15 * part.quad.length)
    order = np.argsort(-length[chosen], kind="stable")[:3]
    return [float(x) for x in offset[chosen][order]]


def _with_ends(part: PartClues, base: FloatArray, paid: float) -> list[Hypothesis]:
    """Hips and half-hips at one end or both; numbers shared by both ends are paid once."""
    each, found = part.clues.per_parameter(), []
    for half in (False, True):
        ends = [_best_end(part, base, (end,), half) for end in (0, 1)]
        both = _best_end(part, base, (0, 1), half)
        apart = np.where(np.isin(np.arange(8), (R3, S3)), ends[1], ends[0])
        numbers = 2 if half else 1
        found += [measured_roof(part, shape, paid + numbers * each + UNLIKELY) for shape in ends]
        found += [measured_roof(part, both, paid + numbers * each)]
        if part.quad.length - apart[R2] - apart[R3] > 0:
            found.append(measured_roof(part, apart, paid + 2 * numbers * each))
        if not half and base[D0] + base[D1] < part.quad.length:
            alike = base.copy()
            alike[[R2, R3]], alike[[S2, S3]] = (base[D0] + base[D1]) / 2, 0.0
            found.append(measured_roof(part, alike, paid))
    return found


def _with_end(part: PartClues, base: FloatArray, paid: float) -> list[Hypothesis]:
    """Hip or half-hip at the right end."""
    each, found = part.clues.per_parameter(), []
    for half in (False, True):
        shape = _best_end(part, base, (1,), half)
        found.append(measured_roof(part, shape, paid + (2 if half else 1) * each))
    return found


def _best_end(part: PartClues, base: FloatArray, ends: Sequence[int], half: bool) -> FloatArray:
    """The shape with the run (and start) of one end, or of both alike, that costs least."""
    width, length = part.quad.width, part.quad.length
    longest = length / 2 if len(ends) == 2 else 0.8 * length
    least = min(width / 2 / STEEPEST_END, longest / 2)

    def shaped(x: FloatArray) -> FloatArray:
        shape = base.copy()
        for end in ends:
            shape[S2 + end] = x[1] / width if half else 0.0
            shape[R2 + end] = min(max(x[0] * (1 - shape[S2 + end]), 0.3), longest)
        return shape

    def cost(x: FloatArray) -> float:
        shape = shaped(x)
        return part.of_shape(shape)[0] + sum(end_cost(shape, end) for end in ends)

    starts = [np.array([min(max(r * width, least), longest), 0.5 * width]) for r in (0.35, 0.5, 0.75)]
    limits = np.array([least, 0.25 * width]), np.array([longest / 0.3 if half else longest, 0.8 * width])
    fits = [minimised(cost, x, limits, 2 if half else 1) for x in starts]
    return shaped(min(fits, key=lambda f: f[1])[0])


def _mansards(part: PartClues, base: Hypothesis, parameters: HypothesisParameters) -> list[Hypothesis]:
    """The best roof with a bend in its slopes."""

    def shaped(x: FloatArray) -> FloatArray:
        shape = base.skeleton.shape.copy()
        shape[BEND], shape[BEND_T] = x[0] / 10, x[1] / 10
        return shape

    half = part.quad.width / 2
    lowest = max(10 * MANSARD_RUN_M / half, 0.8)
    if np.any(base.skeleton.shape[[S2, S3]] % 1 > 0) or lowest > 5:
        return []
    limits = np.array([lowest, 3.0]), np.array([6.0, 9.0])

    def cost(x: FloatArray) -> float:
        fit = part.of_shape(shaped(x))
        return fit[0] if _is_mansard(x, half, fit[2]) else math.inf

    starts = [np.array([max(q, lowest), g]) for q, g in ((1.5, 5.0), (2.5, 6.0), (3.5, 7.0))]
    best = min((minimised(cost, x, limits) for x in starts), key=lambda f: f[1])
    if not math.isfinite(best[1]):
        return []
    fit = measured_roof(part, shaped(best[0]), 0.0)
    paid = 3 * part.clues.per_parameter() + parameters.rare_cost
    return [fit.dearer(paid)]


def _is_mansard(bend: FloatArray, half: float, rise: float) -> bool:
    """Steep below, and much less so above; the bend in tenths of width and rise."""
    q, g = bend / 10
    below, above = rise * g / (q * half), rise * (1 - g) / ((1 - q) * half)
    steep = below >= math.tan(math.radians(MANSARD_DEG))
    return bool(g < 0.98 and steep and below >= MANSARD_RATIO * above)
