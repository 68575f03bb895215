"""Standard deviation of a segment's direction: by its length, and by the scatter of similar segments."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import Segments
from cityflow.splitting.directions.principal_histogram import OWN_SIGMA_DEG

UPRIGHT_DEG, LEVEL_DEG = 80.0, 10.0
POWER = 1.5
"""Of length: a line through n points of independent errors turns by length over the root of n."""
MOST_SIGMA_DEG, NEAR_DEG = 4.0, 4.0
LEAST_COUNT = 15


def aspect_sigma_deg(segments: Segments, off_deg: FloatArray | None, metre_sigma_deg: float) -> FloatArray:
    """(N,) standard deviation of each segment's aspect, degrees.

    Parameters
    ----------
    off_deg : (N,) how far each is off the nearest maximum; None before one is known
    metre_sigma_deg : of a segment of one metre
    """
    plan = np.maximum(segments.length * np.cos(np.radians(segments.slope_deg)), 0.05) ** POWER
    scale = np.full(len(segments), metre_sigma_deg)
    if off_deg is not None:
        kinds = segments.frame * 4 + segments.layer
        for kind in np.unique(kinds):
            mine = kinds == kind
            scale[mine] = _own_scale(off_deg[mine], plan[mine], metre_sigma_deg)
    return np.asarray(np.minimum(np.hypot(OWN_SIGMA_DEG, scale / plan), MOST_SIGMA_DEG))


def slope_sigma_deg(segments: Segments, metre_sigma_deg: float) -> FloatArray:
    """(N,) the same for slopes."""
    scale = metre_sigma_deg / np.maximum(segments.length, 0.05) ** POWER
    return np.asarray(np.minimum(np.hypot(0.3, scale), MOST_SIGMA_DEG))


def _own_scale(off: FloatArray, plan: FloatArray, metre_sigma_deg: float) -> float:
    """Scatter of a kind of segment as if all were of one metre, within a factor of four of what was expected.

    Only those long enough to stay near their maximum tell it.
    """
    told = (np.abs(off) < NEAR_DEG) & (3 * metre_sigma_deg / plan < NEAR_DEG)
    if told.sum() < LEAST_COUNT:
        return metre_sigma_deg
    scatter = 1.4826 * float(np.median(np.abs(off[told]) * plan[told]))
    return float(np.clip(scatter, metre_sigma_deg / 4, metre_sigma_deg * 4))
