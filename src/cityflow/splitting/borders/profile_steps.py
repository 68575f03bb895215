"""Steps of lines that run along a row: both eaves, and the outline itself."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.roof_marks import GUARD_M, REACH_M, WINDOW_M, fitted_lines
from cityflow.splitting.scores.medians import lower_median
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.strip_rasters import RoofRaster

EAVES_M = (0.2, 1.0)
"""How far inside the ends of the chords the height of the eaves is taken."""
OFF = 2.5
"""What is within so many mean distances from the lines on either side is no step."""


def profile_steps(strip: AxisStrip, roof: RoofRaster) -> tuple[FloatArray, FloatArray]:
    """(S, 2) steps of both eaves, and of both ends of the chords, at the borders between the roof's columns, metres, NaN where a side is not known."""
    k = np.clip(
        np.round((roof.u - strip.stations[0]) / (strip.stations[1] - strip.stations[0])).astype(np.int64),
        0,
        len(strip.stations) - 1,
    )
    low, high = strip.low[k], strip.high[k]
    height = np.where(roof.inside, roof.height, np.nan).astype(np.float64)
    inwards = roof.v[None] - low[:, None], high[:, None] - roof.v[None]
    eaves = [lower_median(height, np.isfinite(height) & (d > EAVES_M[0]) & (d < EAVES_M[1])) for d in inwards]
    within = (roof.u >= strip.stations[0]) & (roof.u <= strip.stations[-1])
    ends = np.where(within[:, None], np.column_stack([low, high]), np.nan)
    steps = _steps(np.column_stack([*eaves, ends]), float(roof.u[1] - roof.u[0]))
    return steps[:, :2], steps[:, 2:]


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
