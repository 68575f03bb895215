"""How the colour of a roof changes at a border, and whether that is a shadow's edge or a seam of the mosaic."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.scores.border_sides import DARK, Sides, change_across, share_of
from cityflow.splitting.scores.score_colour import BANDS, bands_of
from cityflow.splitting.strips.strip_evidence import StripEvidence

ROOF_SIDE_M = 3.0
ROOF_GUARD_M = 0.16
ROOF_SHARP_M, ROOF_SHARP_GUARD_M = 1.2, 0.3
LIGHT_LEAST, SEAM_APART = 0.06, 0.4
"""Change of a roof from which it may be a seam of the mosaic: there roof and ground differ, band by band, by a small share of the change."""
SHADOW_LEAST, SHADOW_SIDE_M, SHADOW_HUE = 0.15, 1.5, 0.35
"""Change of a roof from which it may be a shadow's; how far along the ground it is looked for; share of the change that may be one of hue."""
FROM_M, FAR_M, NEAREST_M = 1.8, 12.0, 0.4
"""What throws a shadow is looked for from so far within the darker roof, so far along the row; nearer is roof itself."""
SUN = (0.4, 0.7)
"""Tangents of the elevation of a sun in which surveys are flown: a flatter rise throws no shadow, a steeper one does."""


class RoofChange(NamedTuple):
    """Relative change of a roof's colour, median over bands along the axis, and of its hue, NaN where not known; share of the bands that agree with it;
    whether it brightens along the row."""

    size: float = float("nan")
    hue: float = float("nan")
    alike: float = 0.0
    brightens: bool = False


def roof_change(evidence: StripEvidence, u: float, sides: Sides) -> RoofChange:
    change = evidence.roof_colour
    if change is None:
        return RoofChange()
    edges = bands_of(change.image)
    ratio = change_across(change.image, change.u, u, sides, edges, (ROOF_SIDE_M, ROOF_GUARD_M))
    known = np.isfinite(ratio).all(axis=1)
    if known.sum() < BANDS // 2:
        return RoofChange()
    median = np.median(ratio[known], axis=0)
    size, hue = float(np.abs(median).max()), float(np.abs(median - median.mean()).max())
    alike = float((ratio[known] @ median > 0.4 * float(median @ median)).mean())
    # an edge that runs askew, or fades, is no border at this place
    near = change_across(change.image, change.u, u, sides, edges, (ROOF_SHARP_M, ROOF_SHARP_GUARD_M))
    near = near[np.isfinite(near).all(axis=1)]
    sharp = share_of(near, median) if len(near) >= BANDS // 2 else 1.0
    return RoofChange(size, hue, alike * float(np.sqrt(sharp)), bool(median.mean() > 0))


def is_light(evidence: StripEvidence, u: float, sides: Sides, change: RoofChange) -> bool:
    """True where the ground beside the house darkens or brightens as the roof does: the edge of a shadow, which leaves hues alone, or a seam
    between pictures of two exposures, which changes the hues of both alike."""
    colour = evidence.roof_colour
    if colour is None or not change.size > LIGHT_LEAST:
        return False
    v, at = evidence.roof.v, evidence.roof.u
    edges = bands_of(colour.image)[[0, -1]]
    roof = change_across(colour.image, colour.u, u, sides, edges, (ROOF_SIDE_M, ROOF_GUARD_M))[0]
    low, high = evidence.strip.ends_at(u)
    columns = [(at > u - SHADOW_SIDE_M) & (at < u - 0.2), (at < u + SHADOW_SIDE_M) & (at > u + 0.2)]
    for beside in (v < low - 0.6, v > high + 0.6):
        before, after = (evidence.roof.around[np.ix_(c, beside)].reshape(-1, colour.image.shape[2]) for c in columns)
        before, after = (p[np.isfinite(p).all(axis=1)] for p in (before, after))
        if min(len(before), len(after)) < 20:
            continue
        a, b = np.median(before, axis=0), np.median(after, axis=0)
        ground = (b - a) / (0.5 * (a + b) + DARK)
        if _same_light(roof, ground, change):
            return True
    return False


def shaded(evidence: StripEvidence, u: float, change: RoofChange) -> float:
    """How far a change of a roof may be the shadow of a higher one, 0 to 1: the hues stay, and from the darker side a roof along the row rises steeply
    enough to hide the sun."""
    if not change.size > SHADOW_LEAST or change.hue > SHADOW_HUE * change.size:
        return 0.0
    rise = _rise(evidence, u - FROM_M if change.brightens else u + FROM_M)
    return float(np.clip((rise - SUN[0]) / (SUN[1] - SUN[0]), 0, 1))


def _rise(evidence: StripEvidence, place: float) -> float:
    """Tangent of the steepest rise along the row from a place to roofs around it."""
    height, at = evidence.rows, evidence.roof.u
    known = np.isfinite(height).sum(axis=1) >= 0.4 * height.shape[1]
    here = known & (np.abs(at - place) < NEAREST_M)
    around = known & (np.abs(at - place) > NEAREST_M) & (np.abs(at - place) < FAR_M)
    if not here.any() or not around.any():
        return 0.0
    own = float(np.nanmedian(height[here]))
    return float(((np.nanmedian(height[around], axis=1) - own) / np.abs(at[around] - place)).max())


def _same_light(roof: FloatArray, ground: FloatArray, change: RoofChange) -> bool:
    """Whether roof and ground change as one: by a shadow, or band by band by a seam."""
    size, hue = change.size, change.hue
    mean = float(roof.mean())
    neutral = hue < SHADOW_HUE * size and float(np.abs(ground - ground.mean()).max()) < SHADOW_HUE * size
    shadow = (
        neutral and size > SHADOW_LEAST and 0.6 * abs(mean) < float(ground.mean()) * np.sign(mean) < 1.6 * abs(mean)
    )
    return bool(shadow or np.abs(ground - roof).max() < SEAM_APART * size)
