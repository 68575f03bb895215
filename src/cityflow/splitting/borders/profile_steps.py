"""Steps of lines that run along a row: both eaves, the highest line of the roof and its offset across, and the outline itself."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.roof_marks import GUARD_M, REACH_M, WINDOW_M, fitted_lines
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.strip_rasters import RoofRaster

EAVES_M = (0.2, 1.0)
"""How far inside the ends of the chords the height of the eaves is taken."""
OFF = 2.5
"""What is within so many mean distances from the lines on either side is no step."""


def profile_steps(strip: AxisStrip, roof: RoofRaster) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Steps at the borders between the roof's columns, metres, NaN where a side is not known.

    Returns
    -------
    (S, 3) of the lower eaves, the upper eaves, the highest line; (S,) of the place of that line across; (S, 2) of both ends of the chords
    """
    k = np.clip(
        np.round((roof.u - strip.stations[0]) / (strip.stations[1] - strip.stations[0])).astype(np.int64),
        0,
        len(strip.stations) - 1,
    )
    low, high = strip.low[k], strip.high[k]
    height = np.where(roof.inside, roof.height, np.nan).astype(np.float64)
    inwards = roof.v[None] - low[:, None], high[:, None] - roof.v[None]
    eaves = [_median(np.where((d > EAVES_M[0]) & (d < EAVES_M[1]), height, np.nan)) for d in inwards]
    known = np.isfinite(height).any(axis=1)
    top = np.where(known, np.where(np.isfinite(height), height, -np.inf).max(axis=1), np.nan)
    within = (roof.u >= strip.stations[0]) & (roof.u <= strip.stations[-1])
    ends = np.where(within[:, None], np.column_stack([low, high]), np.nan)
    steps = _steps(np.column_stack([*eaves, top, _top_place(height, roof.v, top), ends]), float(roof.u[1] - roof.u[0]))
    return steps[:, :3], steps[:, 3], steps[:, 4:]


def _median(values: FloatArray) -> FloatArray:
    ordered = np.sort(values, axis=1)
    number = np.isfinite(values).sum(axis=1)
    return np.asarray(
        np.where(number > 0, np.take_along_axis(ordered, np.maximum(number - 1, 0)[:, None] // 2, axis=1)[:, 0], np.nan)
    )


def _top_place(height: FloatArray, v: FloatArray, top: FloatArray) -> FloatArray:
    """(U,) middle across of what is within a hand's breadth of the highest."""
    near = height > top[:, None] - 0.1
    return np.asarray(
        np.where(near.any(axis=1), (near * v[None]).sum(axis=1) / np.maximum(near.sum(axis=1), 1), np.nan)
    )


def _steps(lines: FloatArray, cell: float) -> FloatArray:
    """(S, L) how far lines along the row (U, L) differ between before and after a place, less what bends and scatter explain."""
    guard, width = max(round(GUARD_M / cell), 1), max(round((WINDOW_M - GUARD_M) / cell), 4)
    windows = sliding_window_view(
        np.pad(lines, ((guard + width, guard + width), (0, 0)), constant_values=np.nan), width, axis=0
    )
    x = np.asarray((np.arange(width) + 0.5 + guard) * cell, np.float64)
    places = np.arange(len(lines) + 1)
    before, after = fitted_lines(windows[places], -x[::-1]), fitted_lines(windows[places + 2 * guard + width], x)
    apart = (
        np.abs(after.height - before.height)
        - REACH_M * np.abs(after.slope - before.slope)
        - OFF * np.maximum(before.off, after.off)
    )
    return np.asarray(np.where(np.isfinite(apart), np.maximum(apart, 0.0), np.nan))
