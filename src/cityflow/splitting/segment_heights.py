"""How a line in a raster runs through space: robust planes along both of its sides, and the side that carries it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.splitting.segment_strips import ACROSS, END, LEFT, RIGHT, SCATTER, SLOPE, START, strips

AGREEING = 1.5
"""Sides whose heights differ by less than this many standard deviations are taken for level."""
ONE_PLANE = 1.2
"""One plane through both sides serves when it scatters by no more than this times what the sides do."""


@dataclass(frozen=True, slots=True)
class Courses:
    """How lines run in height, in frame metres; NaN where it cannot be told.

    Attributes
    ----------
    z : (N, 2) float64, at start and end, of the side that carries the line, or of both
    sigma : (N,) float64, expected standard deviation of these heights
    scatter : (N,) float64, robust standard deviation of heights about the side that carries the line
    step : (N,) float64, how much higher one side is than the other;  step_sigma : its standard deviation
    bend_deg : (N,) float64, angle between the slopes across the line of both sides;  bend_sigma_deg : its deviation
    """

    z: FloatArray
    sigma: FloatArray
    scatter: FloatArray
    step: FloatArray
    step_sigma: FloatArray
    bend_deg: FloatArray
    bend_sigma_deg: FloatArray


def courses(dsm: Float32Array, ends: FloatArray, cell: float, step_m: float) -> Courses:
    """Heights of lines at their ends.

    Parameters
    ----------
    dsm : (rows, cols) float32, frame metres
    ends : (N, 2, 2) column and row of start and end, counted from the centre of the first cell
    cell : metres
    step_m : sides that differ by more are a step, and the upper one carries the line
    """
    found = strips(np.ascontiguousarray(dsm, np.float32), np.ascontiguousarray(ends, np.float64), cell)
    left, right, across = found[:, LEFT], found[:, RIGHT], found[:, ACROSS]
    gap = (left[:, :2] - right[:, :2]).mean(axis=1)
    gap_sigma = np.hypot(_sigma(left), _sigma(right))
    carrying = _carrying(left, right, across, (gap, np.maximum(step_m, AGREEING * gap_sigma)))
    bend = np.degrees(np.arctan(left[:, SLOPE]) - np.arctan(right[:, SLOPE]))
    bend_sigma = np.hypot(_slope_sigma(left), _slope_sigma(right))
    return Courses(
        carrying[:, START : END + 1], _sigma(carrying), carrying[:, SCATTER], np.abs(gap), gap_sigma, np.abs(bend), bend_sigma
    )  # fmt: skip


def _carrying(
    left: FloatArray, right: FloatArray, across: FloatArray, gap: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """(N, …) the upper side at a step, one plane where both are one, else the mean of both; a lone side for itself."""
    height, tolerance = gap
    has_left, has_right = np.isfinite(left[:, START]), np.isfinite(right[:, START])
    one = across[:, SCATTER] <= ONE_PLANE * np.maximum(left[:, SCATTER], right[:, SCATTER])
    level = np.where(one[:, None], across, _mean(left, right))
    with np.errstate(invalid="ignore"):
        is_level, left_above = np.abs(height) <= tolerance, height > 0
    both = np.where(is_level[:, None], level, np.where(left_above[:, None], left, right))
    lone = np.where(has_left[:, None], left, right)
    return np.where((has_left & has_right)[:, None], both, lone)


def _mean(left: FloatArray, right: FloatArray) -> FloatArray:
    """Of both sides, the steadier one counting more; its scatter is the larger one."""
    a, b = (1.0 / np.maximum(_sigma(side), 0.005)[:, None] ** 2 for side in (left, right))
    mean = (left * a + right * b) / (a + b)
    mean[:, SCATTER] = np.maximum(left[:, SCATTER], right[:, SCATTER])
    return np.asarray(mean)


def _sigma(side: FloatArray) -> FloatArray:
    """Standard deviation of a fitted line at its ends: twice that of a mean of as many independent heights."""
    return np.asarray(2.0 * side[:, SCATTER] / np.sqrt(side[:, -2]))


def _slope_sigma(side: FloatArray) -> FloatArray:
    """Of the slope across, degrees."""
    return np.asarray(np.degrees(side[:, SCATTER] / np.sqrt(side[:, -2]) * np.sqrt(12.0) / side[:, -1]))
