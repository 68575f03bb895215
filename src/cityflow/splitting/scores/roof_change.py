"""How the colour of a roof changes at a border, and whether that is a shadow's edge or a seam of the mosaic."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.scores.border_sides import Sides, change_across, share_of
from cityflow.splitting.scores.score_colour import BANDS, DARK
from cityflow.splitting.strips.strip_evidence import StripEvidence

ROOF_SIDE_M = 3.0
ROOF_GUARD_M = 0.16
ROOF_SHARP_M, ROOF_SHARP_GUARD_M = 1.2, 0.3
LIGHT_LEAST, SEAM_APART = 0.06, 0.4
"""Change of a roof from which it may be a seam of the mosaic: there roof and ground differ, band by band, by a small share of the change."""
SHADOW_LEAST, SHADOW_SIDE_M, SHADOW_HUE = 0.15, 1.5, 0.35
"""Change of a roof from which it may be a shadow's; how far along the ground it is looked for; share of the change that may be one of hue."""


def roof_change(evidence: StripEvidence, u: float, sides: Sides) -> tuple[float, float, float]:
    """Relative change of the roof's colour, median over bands along the axis; of its hue; share of bands that agree with it."""
    change = evidence.roof_colour
    if change is None:
        return float("nan"), float("nan"), 0.0
    inside = np.atleast_1d(np.isfinite(change.image[..., 0]).any(axis=0))
    first, last = int(np.argmax(inside)), len(inside) - int(np.argmax(inside[::-1]))
    edges = np.linspace(first, last, BANDS + 1).round().astype(np.int64)
    ratio = change_across(change, u, sides, edges, (ROOF_SIDE_M, ROOF_GUARD_M))
    known = np.isfinite(ratio).all(axis=1)
    if known.sum() < BANDS // 2:
        return float("nan"), float("nan"), 0.0
    median = np.median(ratio[known], axis=0)
    size, hue = float(np.abs(median).max()), float(np.abs(median - median.mean()).max())
    alike = float((ratio[known] @ median > 0.4 * float(median @ median)).mean())
    # an edge that runs askew, or fades, is no border at this place
    near = change_across(change, u, sides, edges, (ROOF_SHARP_M, ROOF_SHARP_GUARD_M))
    near = near[np.isfinite(near).all(axis=1)]
    sharp = share_of(near, median) if len(near) >= BANDS // 2 else 1.0
    return size, hue, alike * float(np.sqrt(sharp))


def is_light(evidence: StripEvidence, u: float, sides: Sides, change: tuple[float, float]) -> bool:
    """True where the ground beside the house darkens or brightens as the roof does: the edge of a shadow, which leaves hues alone, or a seam
    between pictures of two exposures, which changes the hues of both alike."""
    size, hue = change
    colour = evidence.roof_colour
    if colour is None or not size > LIGHT_LEAST:
        return False
    v, at = evidence.roof.v, evidence.roof.u
    inside = np.flatnonzero(np.atleast_1d(np.isfinite(colour.image[..., 0]).any(axis=0)))
    edges = np.array([inside[0], inside[-1] + 1], np.int64)
    roof = change_across(colour, u, sides, edges, (ROOF_SIDE_M, ROOF_GUARD_M))[0]
    low, high = evidence.strip.ends_at(u)
    columns = [(at > u - SHADOW_SIDE_M) & (at < u - 0.2), (at < u + SHADOW_SIDE_M) & (at > u + 0.2)]
    for beside in (v < low - 0.6, v > high + 0.6):
        before, after = (evidence.roof.around[np.ix_(c, beside)].reshape(-1, colour.image.shape[2]) for c in columns)
        before, after = (p[np.isfinite(p).all(axis=1)] for p in (before, after))
        if min(len(before), len(after)) < 20:
            continue
        a, b = np.median(before, axis=0), np.median(after, axis=0)
        ground = (b - a) / (0.5 * (a + b) + DARK)
        if _same_light(roof, ground, (size, hue)):
            return True
    return False


def _same_light(roof: FloatArray, ground: FloatArray, change: tuple[float, float]) -> bool:
    """Whether roof and ground change as one: by a shadow, or band by band by a seam."""
    size, hue = change
    mean = float(roof.mean())
    neutral = hue < SHADOW_HUE * size and float(np.abs(ground - ground.mean()).max()) < SHADOW_HUE * size
    shadow = (
        neutral and size > SHADOW_LEAST and 0.6 * abs(mean) < float(ground.mean()) * np.sign(mean) < 1.6 * abs(mean)
    )
    return bool(shadow or np.abs(ground - roof).max() < SEAM_APART * size)
