"""Drain pipes and joints: narrow upright stripes over the whole height of a façade."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.splitting.scores.border_sides import DARK
from cityflow.splitting.scores.medians import middle_of_known
from cityflow.splitting.strips.axis_strips import AxisStrip
from cityflow.splitting.strips.strip_rasters import FacadeRaster

BESIDE_CELLS = (2, 3)
"""A stripe is darker or brighter than what lies so many cells to its left and to its right."""
LEAST_HEIGHT = 0.3
"""Share of the façade's rows that must be known at a stripe."""
FLOOR = 0.03
JOG_M, JOG_REACH_M = 0.3, 0.4
"""Near jogs of the outline upright edges belong to corners of walls."""


def stripes(facades: Sequence[FacadeRaster], strip: AxisStrip) -> FloatArray:
    """(S, 2) how distinct a stripe stands at each station on either side, in its usual size over the façade; 0 without one.

    Parameters
    ----------
    facades : façades in cells no wider than the stripes; of each side the one that shows most is used
    """
    result = np.zeros((len(strip.stations), 2))
    for side in (0, 1):
        seen = [s for s in facades if s.side == side]
        if seen:
            best = max(seen, key=lambda s: int(np.isfinite(s.colour[..., 0]).sum()))
            result[:, side] = _on_side(best, strip)
    return result


def _on_side(facade: FacadeRaster, strip: AxisStrip) -> FloatArray:
    contrast = stripe_contrast(facade.colour.mean(axis=2))
    usual = float(np.median(np.abs(contrast[contrast != 0]))) * 2.0 if (contrast != 0).any() else 0.0
    strength = np.abs(contrast) / max(FLOOR, usual)
    step = float(strip.stations[1] - strip.stations[0])
    cell = float(facade.u[1] - facade.u[0])
    reach = max(int(np.ceil(step / cell / 2)), 1)
    at = np.clip(np.round((strip.stations - facade.u[0]) / cell).astype(np.int64), 0, len(facade.u) - 1)
    near = np.clip(at[:, None] + np.arange(-reach, reach + 1)[None], 0, len(facade.u) - 1)
    result = strength[near].max(axis=1)
    result[_near_jogs(strip.low if facade.side == 0 else strip.high, step)] = 0.0
    return np.asarray(result)


def stripe_contrast(grey: Float32Array) -> FloatArray:
    """(U,) median over the height of how much a column differs from both its sides, relative; 0 where too little is known."""
    left, right = (_either(*(_shifted(grey, sign * k) for k in BESIDE_CELLS)) for sign in (1, -1))
    a, b = grey - left, grey - right
    both = np.where(a * b > 0, np.sign(a) * np.minimum(np.abs(a), np.abs(b)), 0.0) / ((left + right) / 2 + DARK)
    known = np.isfinite(both)
    height = np.isfinite(grey).sum(axis=1)
    result = np.zeros(len(grey))
    if not height.any():
        return result
    enough = known.sum(axis=1) >= LEAST_HEIGHT * float(np.quantile(height[height > 0], 0.8))
    result[enough] = middle_of_known(both[enough].T)
    return result


def _either(a: Float32Array, b: Float32Array) -> Float32Array:
    """Mean of both where both are known, else the one that is."""
    return np.where(np.isfinite(a) & np.isfinite(b), (a + b) / 2, np.where(np.isfinite(a), a, b))


def _shifted(grey: Float32Array, by: int) -> Float32Array:
    result = np.full_like(grey, np.nan)
    if by > 0:
        result[by:] = grey[:-by]
    else:
        result[:by] = grey[-by:]
    return result


def _near_jogs(end: FloatArray, step: float) -> BoolArray:
    jog = np.r_[False, np.abs(np.diff(end)) > JOG_M]
    reach = int(np.ceil(JOG_REACH_M / step))
    return np.asarray(maximum_filter1d(jog.astype(np.uint8), 2 * reach + 1) > 0)
