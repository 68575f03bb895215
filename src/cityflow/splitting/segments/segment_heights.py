"""Course of a line in space: robust planes along both of its sides, and the side that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.splitting.segments.segment_strips import ACROSS, LEFT, RIGHT, Jumps, Strips, jumps, strips

AGREEING = 1.5
"""Sides whose heights differ by less than this many standard deviations are taken for level."""
SURE_JUMP = 3.0
MOST_CUTS = 3
ONE_PLANE = 1.2
"""One plane through both sides serves when it scatters by no more than this times what the sides do."""


@dataclass(frozen=True, slots=True)
class Courses:
    """How lines run in height, in local frame metres; NaN where it cannot be told.

    Attributes
    ----------
    z : (N, 2) float64, at start and end, of the side that carries the line, or of both
    sigma : (N,) float64, expected standard deviation of these heights
    scatter : (N,) float64, robust standard deviation of heights about the side that carries the line
    step : (N,) float64, how much higher one side is than the other;  step_sigma : its standard deviation
    bend_deg : (N,) float64, angle between the slopes across the line of both sides;  bend_sigma_deg : its deviation
    meet : (N, 2) float64, cells to the left of start and end at which the planes of both sides meet
    """

    z: FloatArray
    sigma: FloatArray
    scatter: FloatArray
    step: FloatArray
    step_sigma: FloatArray
    bend_deg: FloatArray
    bend_sigma_deg: FloatArray
    meet: FloatArray


def unbroken(dsm: Float32Array, ends: FloatArray, step_m: float, least_cells: float) -> FloatArray:
    """(M, 2, 2) lines, in their order, cut where the heights along them jump: a ridge over two houses of different height is two ridges.

    Parameters
    ----------
    ends : (N, 2, 2) as in `courses`
    step_m : smaller jumps are borne
    least_cells : no piece is shorter
    """
    done, done_of, of = [ends[:0]], [np.arange(0)], np.arange(len(ends))
    for _ in range(MOST_CUTS):
        long = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) >= 2 * least_cells
        place, long[long] = _places(jumps(dsm, ends[long], least_cells), step_m)
        done, done_of = [*done, ends[~long]], [*done_of, of[~long]]
        middle = ends[long, 0] + place[:, None] * (ends[long, 1] - ends[long, 0])
        ends = np.stack([ends[long, 0], middle, middle, ends[long, 1]], axis=1).reshape(-1, 2, 2)
        of = np.repeat(of[long], 2)
    order = np.argsort(np.concatenate([*done_of, of]), kind="stable")
    return np.concatenate([*done, ends])[order]


def _places(found: Jumps, step_m: float) -> tuple[FloatArray, BoolArray]:
    """Where those lines jump that do, and which these are: by the upper side at a step, else by both sides at one place."""
    row, upper = np.arange(len(found.gap)), np.where(found.gap > 0, LEFT, RIGHT)
    sure = np.abs(found.height) > np.maximum(0.6 * step_m, SURE_JUMP * found.sigma)
    alike = sure.all(axis=1) & (np.ptp(found.share, axis=1) < 0.15) & (found.height.prod(axis=1) > 0)
    jumped = np.where(np.abs(found.gap) > 2 * step_m, sure[row, upper], alike)
    return found.share[row, upper][jumped], jumped


def courses(dsm: Float32Array, ends: FloatArray, cell: float, step_m: float) -> Courses:
    """Heights of lines at their ends.

    Parameters
    ----------
    dsm : (rows, cols) float32, local frame metres
    ends : (N, 2, 2) column and row of start and end, counted from the centre of the first cell
    cell : metres
    step_m : sides that differ by more are a step, and the upper one carries the line
    """
    found = strips(dsm, ends, cell)
    left, right, across = found.of(LEFT), found.of(RIGHT), found.of(ACROSS)
    gap = (left.z - right.z).mean(axis=1)
    gap_sigma = np.hypot(_sigma(left), _sigma(right))
    carrying = _carrying(left, right, across, (gap, np.maximum(step_m, AGREEING * gap_sigma)))
    bend = np.degrees(np.arctan(left.slope) - np.arctan(right.slope))
    bend_sigma = np.hypot(_slope_sigma(left), _slope_sigma(right))
    fall = right.slope - left.slope
    with np.errstate(divide="ignore", invalid="ignore"):
        meet = (left.z - right.z) / fall[:, None]
    return Courses(
        carrying.z, _sigma(carrying), carrying.scatter, np.abs(gap), gap_sigma, np.abs(bend), bend_sigma,
        meet / cell,
    )  # fmt: skip


def _carrying(left: Strips, right: Strips, across: Strips, gap: tuple[FloatArray, FloatArray]) -> Strips:
    """The upper side at a step, one plane where both are one, else the mean of both; a lone side for itself."""
    height, tolerance = gap
    has_left, has_right = np.isfinite(left.independent), np.isfinite(right.independent)
    one = across.scatter <= ONE_PLANE * np.maximum(left.scatter, right.scatter)
    level = _where(one, across, _mean(left, right))
    with np.errstate(invalid="ignore"):
        is_level, left_above = np.abs(height) <= tolerance, height > 0
    both = _where(is_level, level, _where(left_above, left, right))
    return _where(has_left & has_right, both, _where(has_left, left, right))


def _where(chosen: BoolArray, a: Strips, b: Strips) -> Strips:
    return Strips(*(np.where(chosen if x.ndim == 1 else chosen[:, None], x, y) for x, y in zip(a, b, strict=True)))


def _mean(left: Strips, right: Strips) -> Strips:
    """Of both sides, the steadier one counting more; its scatter is the larger one."""
    a, b = (1.0 / np.maximum(_sigma(side), 0.005) ** 2 for side in (left, right))
    z, _, *rest = (((x.T * a + y.T * b) / (a + b)).T for x, y in zip(left, right, strict=True))
    return Strips(z, np.maximum(left.scatter, right.scatter), *rest)


def _sigma(side: Strips) -> FloatArray:
    """Standard deviation of a fitted line at its ends: twice that of a mean of as many independent heights."""
    return np.asarray(2.0 * side.scatter / np.sqrt(side.independent))


def _slope_sigma(side: Strips) -> FloatArray:
    """Of the slope across, degrees."""
    return np.asarray(np.degrees(side.scatter / np.sqrt(side.independent) * np.sqrt(12.0) / side.width))
