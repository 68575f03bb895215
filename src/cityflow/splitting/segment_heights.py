"""How a line in a raster runs through space: robust planes along both of its sides, and the side that carries it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray

STATIONS = 48
"""Places along a line at which heights are looked up; more do not make it surer."""
ROUNDS = 6
INNER_CELLS, OUTER_CELLS = 1.0, 5.0
"""A matched step is smeared over a cell or two: the nearest cells belong to neither side."""


@dataclass(frozen=True, slots=True)
class Courses:
    """Heights along lines, in frame metres.

    Attributes
    ----------
    z : (N, 2) float64, at start and end, of the side that carries the line; NaN where the course cannot be told
    step : (N,) float64, how much higher one side is than the other in the middle of the line; NaN where one is unknown
    scatter : (N,) float64, robust standard deviation of heights about the side that carries the line
    """

    z: FloatArray
    step: FloatArray
    scatter: FloatArray

    def known(self, scatter_m: float) -> BoolArray:
        return np.asarray(np.isfinite(self.z).all(axis=1) & (self.scatter <= scatter_m))


def courses(dsm: Float32Array, ends: FloatArray, cell: float, step_m: float) -> Courses:
    """Heights of lines at their ends.

    Parameters
    ----------
    dsm : (rows, cols) float32, frame metres
    ends : (N, 2, 2) column and row of start and end, counted from the centre of the first cell
    cell : metres
    step_m : sides that differ by more are a step, and the upper one carries the line
    """
    sides = _sides(np.ascontiguousarray(dsm, np.float32), np.ascontiguousarray(ends, np.float64), cell)
    left, right = sides[:, 0], sides[:, 1]
    gap = (left[:, :2] - right[:, :2]).mean(axis=1)
    noise = np.hypot(left[:, 2], right[:, 2])
    level = np.abs(gap) <= np.maximum(step_m, noise)
    both = np.where(level[:, None], _weighted(left, right), np.where((gap > 0)[:, None], left, right))
    both = np.where(np.isfinite(left[:, :1]), np.where(np.isfinite(right[:, :1]), both, left), right)
    return Courses(both[:, :2], np.abs(gap), both[:, 2])


def _weighted(left: FloatArray, right: FloatArray) -> FloatArray:
    """Mean of both sides, the steadier one counting more; its scatter is the larger."""
    a, b = (1.0 / np.maximum(side[:, 2:3], 0.005) ** 2 for side in (left, right))
    mean = (left * a + right * b) / (a + b)
    mean[:, 2] = np.maximum(left[:, 2], right[:, 2])
    return np.asarray(mean)


@njit(cache=True, nogil=True)
def _sides(dsm: Float32Array, ends: FloatArray, cell: float) -> FloatArray:
    """(N, 2, 3): for the left and right side of each line its height at start and end, and the scatter there."""
    result = np.full((len(ends), 2, 3), np.nan)
    t, u, z = np.empty(STATIONS * 4), np.empty(STATIONS * 4), np.empty(STATIONS * 4)
    for i in range(len(ends)):
        length = np.hypot(ends[i, 1, 0] - ends[i, 0, 0], ends[i, 1, 1] - ends[i, 0, 1])
        if length < 1e-6:
            continue
        stations = min(max(int(length), 4), STATIONS)
        for side in range(2):
            count = _gather(dsm, ends[i], length, stations, 1.0 - 2.0 * side, t, u, z)
            if count < 2 * stations:
                continue
            _fit(t[:count], u[:count], z[:count], cell, result[i, side])
    return result


@njit(cache=True, nogil=True)
def _gather(
    dsm: Float32Array, ends: FloatArray, length: float, stations: int, sign: float,
    t: FloatArray, u: FloatArray, z: FloatArray,
) -> int:  # fmt: skip
    """Known heights on one side: share of the way, cells across and metres, of the centres of the cells met."""
    rows, cols = dsm.shape
    along_x, along_y = (ends[1, 0] - ends[0, 0]) / length, (ends[1, 1] - ends[0, 1]) / length
    count = 0
    for k in range(stations):
        s = length * (k + 0.5) / stations
        for j in range(4):
            w = sign * (INNER_CELLS + (OUTER_CELLS - INNER_CELLS) * (j + 0.5) / 4)
            col = int(np.floor(ends[0, 0] + s * along_x - w * along_y + 0.5))
            row = int(np.floor(ends[0, 1] + s * along_y + w * along_x + 0.5))
            if row < 0 or col < 0 or row >= rows or col >= cols or not np.isfinite(dsm[row, col]):
                continue
            x, y = col - ends[0, 0], row - ends[0, 1]
            t[count] = (x * along_x + y * along_y) / length
            u[count] = y * along_x - x * along_y
            z[count] = dsm[row, col]
            count += 1
    return count


@njit(cache=True, nogil=True)
def _fit(t: FloatArray, u: FloatArray, z: FloatArray, cell: float, result: FloatArray) -> None:
    """Plane through one side by least absolute deviations; its heights on the line, and the scatter about it."""
    n = len(t)
    weight = np.ones(n)
    rest = np.empty(n)
    middle = np.median(z)
    a, b, c = middle, 0.0, 0.0
    for _ in range(ROUNDS):
        m = np.zeros((3, 3))
        v = np.zeros(3)
        for i in range(n):
            w, ti, ui, zi = weight[i], t[i] - 0.5, u[i], z[i] - middle
            m[0, 0] += w
            m[0, 1] += w * ti
            m[0, 2] += w * ui
            m[1, 1] += w * ti * ti
            m[1, 2] += w * ti * ui
            m[2, 2] += w * ui * ui
            v[0] += w * zi
            v[1] += w * ti * zi
            v[2] += w * ui * zi
        m[1, 0], m[2, 0], m[2, 1] = m[0, 1], m[0, 2], m[1, 2]
        for k in range(3):
            m[k, k] += 1e-9 * n
        solved = np.linalg.solve(m, v)
        a, b, c = solved[0] + middle, solved[1], solved[2]
        for i in range(n):
            rest[i] = abs(z[i] - a - b * (t[i] - 0.5) - c * u[i])
            weight[i] = 1.0 / max(rest[i], 0.1 * cell)
    result[0], result[1] = a - 0.5 * b, a + 0.5 * b
    result[2] = 1.4826 * np.median(rest)
