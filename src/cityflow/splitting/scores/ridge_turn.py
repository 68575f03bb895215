"""Whether the slopes of a roof turn at a place: where two wings meet, one ridge runs along the row and the other across it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.splitting.strips.strip_rasters import RoofRaster

GUARD_M, SIDE_M = 0.4, 4.0
"""Slopes are compared between these distances before and after the place."""
BASE_M = 0.3
"""A slope is measured over twice this length."""
STEEP, LEVEL = 2.0, 0.08
"""Tangents: what is steeper is an edge; a roof that is flatter has no direction."""
LEAST_CELLS, LEAST_COLUMNS = 50, 3


class RoofSlopes(NamedTuple):
    """(U,) u of the columns, metres; (U, V) slopes along the row and across it, NaN where not known."""

    u: FloatArray
    along: FloatArray
    across: FloatArray


def roof_slopes(roof: RoofRaster) -> RoofSlopes:
    height, cell = roof.height.astype(np.float64), float(roof.u[1] - roof.u[0])
    k = max(round(BASE_M / cell), 1)
    along, across = np.full(height.shape, np.nan), np.full(height.shape, np.nan)
    along[k:-k] = (height[2 * k :] - height[: -2 * k]) / (2 * k * cell)
    across[:, k:-k] = (height[:, 2 * k :] - height[:, : -2 * k]) / (2 * k * cell)
    return RoofSlopes(roof.u, along, across)


def ridge_turn(slopes: RoofSlopes, u: float) -> float:
    """0 where ridges run alike on both sides of u, 1 where they are at right angles; NaN where a side is level or not known."""
    before = (slopes.u > u - SIDE_M) & (slopes.u < u - GUARD_M)
    after = (slopes.u > u + GUARD_M) & (slopes.u < u + SIDE_M)
    return abs(_share_along(slopes, after) - _share_along(slopes, before))


def _share_along(slopes: RoofSlopes, columns: BoolArray) -> float:
    """Of the usual slope the share along the row."""
    if columns.sum() < LEAST_COLUMNS:
        return float("nan")
    along, across = slopes.along[columns], slopes.across[columns]
    known = np.hypot(along, across) < STEEP
    if known.sum() < LEAST_CELLS:
        return float("nan")
    a, b = float(np.median(np.abs(along[known]))), float(np.median(np.abs(across[known])))
    return a / (a + b) if np.hypot(a, b) > LEVEL else float("nan")
