"""Steps of the roof at a station: lines along the axis, fitted before and after it and prolonged to it, row by row."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.scores.score_colour import QUIET, QUIET_SIGMAS
from cityflow.splitting.strips.strip_rasters import RoofRaster

GROUPS = 4
"""The depth of a roof is looked at in so many parts from eaves to eaves."""
ROW_M = 0.3
FLOOR_M = 0.04
VALLEY_SLOPE = 0.2
"""Roofs that fall towards a line from both sides more steeply than this meet in a valley."""
STRAIGHT_M = 0.15
"""A roof that is farther off its line, in the mean square, is none that falls or rises: it steps."""


@dataclass(frozen=True, slots=True)
class HeightChange:
    """(S,) each.

    Attributes
    ----------
    share : of the parts that step clearly, 0 to 1
    significance : step over its usual size where nothing changes; steps are medians over parts of the depth
    valley : by how much the roof bends up where it falls before and rises after; 0 elsewhere
    """

    share: FloatArray
    significance: FloatArray
    valley: FloatArray
    u: FloatArray
    rows: FloatArray


def height_change(roof: RoofRaster, stations: FloatArray, window_m: float, guard_m: float) -> HeightChange:
    """Steps at every station."""
    cell = float(roof.u[1] - roof.u[0])
    rows = _rows(roof, max(round(ROW_M / cell), 1))
    width, guard = max(round(window_m / cell), 3), round(guard_m / cell)
    border = np.round((stations - (roof.u[0] - cell / 2)) / cell).astype(np.int64)
    before, slope_before, off_before = _prolonged(rows, border - guard - width, border - guard, border, cell)
    after, slope_after, off_after = _prolonged(rows, border + guard, border + guard + width, border, cell)
    step = after - before
    grouped = _grouped(step)
    size = np.abs(grouped)
    usual = _usual(size)
    noise = np.hypot(FLOOR_M, min(usual, 4 * FLOOR_M))
    known = np.isfinite(size).sum(axis=1)
    with np.errstate(invalid="ignore"):
        share = np.where(known > 0, (size > np.maximum(0.1, 3 * noise)).sum(axis=1) / np.maximum(known, 1), np.nan)
    falls, rises = _median(slope_before), _median(slope_after)
    straight = np.fmax(_median(off_before), _median(off_after)) < STRAIGHT_M
    valley = np.where(straight & (np.minimum(-falls, rises) > VALLEY_SLOPE), rises - falls, 0.0)
    return HeightChange(share, _median(size) / noise, valley, roof.u, rows)


def _rows(roof: RoofRaster, width: int) -> FloatArray:
    """(U, R) heights, medians over `width` cells across the axis."""
    inside = np.isfinite(roof.height).any(axis=0)
    columns = np.flatnonzero(inside)
    if not len(columns):
        return np.full((len(roof.u), 1), np.nan)
    part = roof.height[:, columns[0] : columns[-1] + 1]
    count = max(part.shape[1] // width, 1)
    part = part[:, : count * width].reshape(len(roof.u), count, -1).astype(np.float64)
    # the middle one of three or so: sorting puts NaN last, and a column with a hole keeps its lower ones
    return np.asarray(np.sort(part, axis=2)[:, :, (part.shape[2] - 1) // 2])


def _prolonged(
    rows: FloatArray, first: np.ndarray, after: np.ndarray, border: np.ndarray, cell: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(S, R) heights at the borders of least-squares lines through columns first … after − 1, their slopes, and how far the roof is off them, rms."""
    known = np.isfinite(rows)
    level = np.nanmean(rows) if known.any() else 0.0
    z = np.where(known, rows - level, 0.0)
    x = (np.arange(len(rows)) * cell)[:, None] * known
    sums = [_cumulated(np.asarray(a, np.float64)) for a in (known, x, z, x * x, x * z, z * z)]
    a, b = np.clip(first, 0, len(rows)), np.clip(after, 0, len(rows))
    n, s_x, s_z, s_xx, s_xz, s_zz = (s[b] - s[a] for s in sums)
    enough = n >= 0.6 * (after - first)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        slope = (s_xz - s_x * s_z / n) / (s_xx - s_x * s_x / n)
        at = (border[:, None] - 0.5) * cell
        value = s_z / n + slope * (at - s_x / n) + level
        off = np.sqrt(np.maximum(s_zz - s_z * s_z / n - slope * (s_xz - s_x * s_z / n), 0.0) / n)
    return np.where(enough, value, np.nan), np.where(enough, slope, np.nan), np.where(enough, off, np.nan)


def _cumulated(a: FloatArray) -> FloatArray:
    return np.concatenate([np.zeros((1, a.shape[1])), np.cumsum(a, axis=0)])


def _grouped(step: FloatArray) -> FloatArray:
    """(S, GROUPS) median step in each part of the depth that is there at the station."""
    edges = np.linspace(0, step.shape[1], GROUPS + 1).round().astype(int)
    return np.column_stack([_median(step[:, a:b]) for a, b in pairwise(edges.tolist()) if b > a])


def _median(values: FloatArray) -> FloatArray:
    known = np.isfinite(values).sum(axis=1) >= 0.4 * values.shape[1]
    result = np.full(len(values), np.nan)
    result[known] = np.nanmedian(values[known], axis=1)
    return result


def _usual(size: FloatArray) -> float:
    known = size[np.isfinite(size)]
    return float(np.quantile(known, QUIET)) / QUIET_SIGMAS if len(known) > 10 else 0.0
