"""Course of a line in space: robust planes along both of its sides, and the side that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.splitting.segment_strips import ACROSS, END, LEFT, RIGHT, SCATTER, SLOPE, START, jumps, strips

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
    meet_z : (N, 2) float64, the height there
    """

    z: FloatArray
    sigma: FloatArray
    scatter: FloatArray
    step: FloatArray
    step_sigma: FloatArray
    bend_deg: FloatArray
    bend_sigma_deg: FloatArray
    meet: FloatArray
    meet_z: FloatArray


def unbroken(
    dsm: Float32Array, ends: FloatArray, cell: float, step_m: float, least_cells: float
) -> tuple[FloatArray, IntArray]:
    """Lines cut where the heights along them jump: a ridge over two houses of different height is two ridges.

    Parameters
    ----------
    ends : (N, 2, 2) as in `courses`
    step_m : smaller jumps are borne
    least_cells : no piece is shorter

    Returns
    -------
    (M, 2, 2) pieces, and (M,) the line that each is of
    """
    dsm, whole = np.ascontiguousarray(dsm, np.float32), np.arange(len(ends))
    done, done_of, pieces, of = [ends[:0]], [whole[:0]], ends, whole
    for _ in range(MOST_CUTS):
        long = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1) >= 2 * least_cells
        candidates = np.ascontiguousarray(pieces[long])
        place, jumped = _places(jumps(dsm, candidates, cell, least_cells), strips(dsm, candidates, cell, False), step_m)
        long[long] = jumped
        done, done_of = [*done, pieces[~long]], [*done_of, of[~long]]
        middle = pieces[long, 0] + place[jumped, None] * (pieces[long, 1] - pieces[long, 0])
        first, second = np.stack([pieces[long, 0], middle], axis=1), np.stack([middle, pieces[long, 1]], axis=1)
        pieces, of = np.concatenate([first, second]), np.concatenate([of[long], of[long]])
    every, every_of = np.concatenate([*done, pieces]), np.concatenate([*done_of, of])
    order = np.argsort(every_of, kind="stable")
    return every[order], every_of[order]


def _places(found: FloatArray, sides: FloatArray, step_m: float) -> tuple[FloatArray, BoolArray]:
    """Where each line jumps, and whether it does: the upper side at a step, else both sides at one place."""
    gap = (sides[:, LEFT, :2] - sides[:, RIGHT, :2]).mean(axis=1)
    row, upper = np.arange(len(found)), np.where(gap > 0, LEFT, RIGHT)
    sure = np.abs(found[..., 1]) > np.maximum(0.6 * step_m, SURE_JUMP * found[..., 2])
    alike = sure.all(axis=1) & (np.abs(found[:, 0, 0] - found[:, 1, 0]) < 0.15) & (found[:, 0, 1] * found[:, 1, 1] > 0)
    with np.errstate(invalid="ignore"):
        is_step = np.abs(gap) > 2 * step_m
    return found[row, upper, 0], np.where(is_step, sure[row, upper], alike)


def courses(dsm: Float32Array, ends: FloatArray, cell: float, step_m: float) -> Courses:
    """Heights of lines at their ends.

    Parameters
    ----------
    dsm : (rows, cols) float32, local frame metres
    ends : (N, 2, 2) column and row of start and end, counted from the centre of the first cell
    cell : metres
    step_m : sides that differ by more are a step, and the upper one carries the line
    """
    found = strips(np.ascontiguousarray(dsm, np.float32), np.ascontiguousarray(ends, np.float64), cell, True)
    left, right, across = found[:, LEFT], found[:, RIGHT], found[:, ACROSS]
    gap = (left[:, :2] - right[:, :2]).mean(axis=1)
    gap_sigma = np.hypot(_sigma(left), _sigma(right))
    carrying = _carrying(left, right, across, (gap, np.maximum(step_m, AGREEING * gap_sigma)))
    bend = np.degrees(np.arctan(left[:, SLOPE]) - np.arctan(right[:, SLOPE]))
    bend_sigma = np.hypot(_slope_sigma(left), _slope_sigma(right))
    fall = right[:, SLOPE] - left[:, SLOPE]
    with np.errstate(divide="ignore", invalid="ignore"):
        meet = (left[:, :2] - right[:, :2]) / fall[:, None]
    meet_z = left[:, :2] + left[:, SLOPE, None] * meet
    return Courses(
        carrying[:, START : END + 1], _sigma(carrying), carrying[:, SCATTER], np.abs(gap), gap_sigma, np.abs(bend), bend_sigma,
        meet / cell, meet_z,
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
