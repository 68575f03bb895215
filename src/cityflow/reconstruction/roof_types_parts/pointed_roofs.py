"""Pyramids, and roofs of several teeth."""

from __future__ import annotations

import math

import numpy as np

from cityflow.core.roof_type_names import RoofType
from cityflow.reconstruction.roof_types_parts import skeletons
from cityflow.reconstruction.roof_types_parts.hypothesis import (
    MOST_TEETH,
    Hypothesis,
    HypothesisParameters,
    PartClues,
    least_rise,
    measured_roof,
)
from cityflow.reconstruction.roof_types_parts.shape_fit import line_gain
from cityflow.reconstruction.roof_types_parts.skeletons import D0, D1, R2, R3, S2, S3, Skeleton


def pyramid(part: PartClues) -> Hypothesis:
    """Four faces that meet over the middle."""
    shape = skeletons.ridge_shape(part.quad)
    # Distances of one place to all four sides, so that the faces meet there exactly, however skewed the sides are.
    shape[[D0, D1, R2, R3]] = part.quad.distances(part.quad.middle[None])[0]
    shape[[S2, S3]] = 0.0
    fit = measured_roof(part, shape, part.clues.per_parameter())
    slender = max(0.0, part.quad.length / part.quad.width - 1.25)
    low = fit.skeleton.rise < least_rise(part.quad.width / 2)
    return fit.dearer(math.inf if low else 20 * slender)


def sawtooths(part: PartClues, parameters: HypothesisParameters) -> list[Hypothesis]:
    """Sheds side by side, as many as fit best."""
    length, found = part.quad.length, []
    for teeth in range(2, min(MOST_TEETH, int(length / 3.0)) + 1):
        t = skeletons.tooth_heights(part.d, length, teeth)
        cost, eave, rise = part.of_heights(t)
        gain = part.clues.trust * tooth_gain(part, teeth)
        shape = skeletons.ridge_shape(part.quad)
        if abs(rise) >= least_rise(length / teeth):
            skeleton = Skeleton(RoofType.SAWTOOTH, part.quad, shape, eave, rise, teeth)
            paid = 3 * part.clues.per_parameter() + parameters.rare_cost
            found.append(Hypothesis(skeleton, cost - gain + paid, paid - gain))
    return found


def tooth_gain(part: PartClues, teeth: int) -> float:
    """What lines say of the steps between teeth."""
    sides, pitch = part.quad.sides, part.quad.length / teeth
    edges = []
    for k in range(1, teeth):
        step = sides[2] + np.array([0, 0, k * pitch])
        ends = [np.linalg.solve(np.stack([side[:2], step[:2]]), [side[2], step[2]]) for side in sides[:2]]
        edges.append(np.concatenate(ends))
    return float(line_gain(np.array(edges), part.clues.segments))
