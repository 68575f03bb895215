"""A roof of one type over a quadrilateral, and the clues it is judged by."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from pydantic import Field

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.core.roof_type_names import RoofType
from cityflow.reconstruction.roof_types_parts.shape_fit import Clues, cell_means, fitted_heights, ridge_cost
from cityflow.reconstruction.roof_types_parts.skeletons import BEND, D0, D1, R2, R3, S2, S3, Quad, Skeleton

PYRAMID_RIDGE_M = 1.0
"""Hip roofs with shorter ridges are pyramids; set by hand, as is the next."""
STEPS_M = (0.8, 0.4, 0.2, 0.1, 0.05)
"""Of the search for the cheapest shape, each half the one before."""

OFF_MIDDLE = 0.22
"""Ridges lie within this share of the width of the middle; set by hand, as are those below."""
OFF_MIDDLE_COST = 3.0
"""Cost of a ridge off the middle, besides its number, as log-likelihood."""
END_STEEPNESS = 0.3
"""How far slopes of ends and sides differ, as sigma of the logarithm of their ratio."""
STEEPEST_END = 2.0
"""Ends are steeper than the sides by this factor at most."""
MANSARD_RATIO = 1.7
"""A mansard is steeper below than above by this factor,"""
MANSARD_DEG = 48.0
"""at least so steep below, degrees,"""
MANSARD_RUN_M = 0.7
"""and bends no nearer to its eave than this, m."""
MOST_TEETH = 12
"""Most sheds of a sawtooth that are tried."""
LEAST_RISE_M, LEAST_SLOPE_DEG = 0.5, 3.5
"""Roofs that rise less, or are less steep, are flat; set by hand."""
SHED_COST = 2.0
"""Cost of a shed beyond its numbers, as log-likelihood."""


class HypothesisParameters(Parameters):
    """What roofs may look like."""

    rare_cost: float = Field(
        8.0, ge=0, le=50, description="cost of mansard, butterfly and sawtooth beyond their numbers"
    )


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A skeleton with its cost, in which the numbers that were free are counted; `beside`: what of it heights did not cause."""

    skeleton: Skeleton
    cost: float
    beside: float = 0.0

    def dearer(self, by: float) -> Hypothesis:
        return Hypothesis(self.skeleton, self.cost + by, self.beside + by)


@dataclass
class PartClues:
    """Clues of one unit as one part sees them: some of the cells, distances to its sides, and its slope where that is known."""

    clues: Clues
    quad: Quad
    slope: float = math.nan
    d: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        self.d = self.quad.distances(self.clues.cells.xy)

    def of_shape(self, shape: FloatArray) -> tuple[float, float, float, float]:
        c = self.clues
        return ridge_cost(shape, self.quad.sides, self.d, c.heights, c.lines, self.slope)

    def of_heights(self, t: FloatArray) -> tuple[float, float, float]:
        c = self.clues
        means = cell_means(t, c.cells.cell, len(c.cells))
        return fitted_heights(means, c.cells.z, c.cells.weight, c.sigma, math.nan, 0.0)


def least_rise(run: float) -> float:
    return max(LEAST_RISE_M, run * math.tan(math.radians(LEAST_SLOPE_DEG)))


def measured_roof(part: PartClues, shape: FloatArray, paid: float) -> Hypothesis:
    """A shape with its heights; its type follows from its ends."""
    cost, eave, rise, gain = part.of_shape(shape)
    paid += sum(end_cost(shape, end) for end in (0, 1))
    skeleton = Skeleton(type_of_ends(shape, part.quad, rise), part.quad, shape, eave, rise)
    return Hypothesis(skeleton, cost + paid, paid - gain)


def minimised(
    cost: Callable[[FloatArray], float],
    start: FloatArray,
    limits: tuple[FloatArray, FloatArray],
    free: int | None = None,
) -> tuple[FloatArray, float]:
    """A minimum near a start, by steps along the axes that get shorter; the place and its cost."""
    x, best = start.copy(), cost(start)
    for step in STEPS_M:
        for _ in range(4):
            before = best
            for k in range(len(x) if free is None else free):
                for sign in (step, -step):
                    other = x.copy()
                    other[k] = min(max(other[k] + sign, limits[0][k]), limits[1][k])
                    value = cost(other)
                    if value < best - 1e-9:
                        x, best = other, value
                        break
            if best >= before:
                break
    return x, best


def end_cost(shape: FloatArray, end: int) -> float:
    """Ends are about as steep as the sides."""
    start = shape[S2 + end]
    if start >= 1:
        return 0.0
    steeper = (1 - start) * (shape[D0] + shape[D1]) / 2 / shape[R2 + end]
    return 0.5 * (math.log(steeper) / END_STEEPNESS) ** 2


def type_of_ends(shape: FloatArray, quad: Quad, rise: float) -> RoofType:
    starts = shape[[S2, S3]]
    if rise < 0:
        return RoofType.BUTTERFLY
    if shape[BEND] < 1:
        return RoofType.MANSARD
    if np.all(starts == 0) and quad.length - shape[R2] - shape[R3] < PYRAMID_RIDGE_M:
        return RoofType.PYRAMID
    if np.any(starts == 0):
        return RoofType.HIP
    return RoofType.GABLE if np.all(starts == 1) else RoofType.HALF_HIP
