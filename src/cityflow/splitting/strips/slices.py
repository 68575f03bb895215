"""Slices of an axis strip and what of the segments lies in each (Dahlke 2017 §2.2).

Points are laid on the segments at GSD spacing, each with the segment's attitude. A slice is as wide as two GSD; in it, upright segments at
either façade and segments along the slice on the roof are told by the share of the façade's height and of the slice's length that they cover.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.splitting import Segments
from cityflow.splitting.strips.axis_strips import AxisStrip

UPRIGHT_DEG = 75.0
"""Steeper segments are upright."""
ALONG_SLICE_DEG = 8.0
"""How far a segment in a slice may be turned from it in plan."""
CELL_M = 0.25
"""Coverage is counted in cells of this size, up the façade and along the slice."""
BESIDE_M = 0.25
"""Slices so near to a place tell of it."""
USUAL_EAVES_M = 6.0
"""Height of eaves that are not known."""
FACADE_REACH_M = 1.0
"""How far upright segments may stand from the outline: eaves, reveals, bays."""


@dataclass(frozen=True, slots=True)
class SegmentPoints:
    """Points on segments: (P, 3) world metres, whether the segment that each lies on is upright, and its direction in plan."""

    xyz: FloatArray
    upright: BoolArray
    aspect_deg: FloatArray


@dataclass(frozen=True, slots=True)
class SliceEvidence:
    """Of each station of an axis strip, (S,) each.

    Attributes
    ----------
    vertical : (S, 2) share of the façade's height with upright segments, at the lower and the upper end
    sloped : (S,) share of the chord with segments along it that are not upright
    """

    vertical: FloatArray
    sloped: FloatArray


def slices_at(stations: FloatArray, u: float) -> BoolArray:
    """(S,) the slices that tell of a place, at least one."""
    off = np.abs(stations - u)
    return np.asarray((off < BESIDE_M) | (np.arange(len(off)) == np.argmin(off)))


def points_on_segments(segments: Segments, spacing_m: float) -> SegmentPoints:
    """Evenly spaced points, both ends included."""
    length = segments.length
    count = np.maximum(np.ceil(length / spacing_m).astype(np.int64), 1) + 1
    owner = np.repeat(np.arange(len(segments)), count)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    share = (place / (count[owner] - 1))[:, None]
    xyz = segments.start[owner] + share * (segments.end - segments.start)[owner]
    upright = segments.slope_deg > UPRIGHT_DEG
    return SegmentPoints(xyz, upright[owner], segments.aspect_deg[owner])


def slice_evidence(
    strip: AxisStrip, points: SegmentPoints, heights: tuple[FloatArray, FloatArray], ground: float
) -> SliceEvidence:
    """Count what lies in each slice.

    Parameters
    ----------
    heights : (S,) each: height of the eaves at the lower and at the upper end of each chord; NaN where unknown
    ground : height of the ground, metres
    """
    uv = strip.to_uv(points.xyz[:, :2])
    step = float(strip.stations[1] - strip.stations[0])
    at = np.floor((uv[:, 0] - strip.stations[0]) / step + 0.5).astype(np.int64)
    within = (at >= 0) & (at < len(strip.stations))
    at = np.where(within, at, 0)
    within &= (uv[:, 1] > strip.low[at] - FACADE_REACH_M) & (uv[:, 1] < strip.high[at] + FACADE_REACH_M)
    vertical = []
    for end, eaves in zip((strip.low, strip.high), heights, strict=True):
        top = np.where(
            np.isfinite(eaves), eaves, np.nanmedian(eaves) if np.isfinite(eaves).any() else ground + USUAL_EAVES_M
        )
        upright = within & points.upright & (np.abs(uv[:, 1] - end[at]) < FACADE_REACH_M)
        vertical.append(_share(at[upright], points.xyz[upright, 2] - ground, np.round((top - ground) / CELL_M)))
    turn = np.abs((points.aspect_deg - strip.aspect_deg) % 180.0 - 90.0)
    lying = within & ~points.upright & (turn < ALONG_SLICE_DEG)
    sloped = _share(at[lying], uv[lying, 1] - strip.low[at[lying]], np.ceil((strip.high - strip.low) / CELL_M))
    return SliceEvidence(np.column_stack(vertical), sloped)


def _share(at: IntArray, off_m: FloatArray, cells: FloatArray) -> FloatArray:
    """(S,) of the cells of each slice the share in which a point lies, of the slice or of one beside it: an edge seldom runs down the middle of a slice.

    Parameters
    ----------
    at, off_m : (P,) slice of each point, and how far it is along it, or up the façade, metres
    cells : (S,) number in each slice
    """
    cells, k = np.maximum(cells.astype(np.int64), 1), np.floor(off_m / CELL_M).astype(np.int64)
    there = (k >= 0) & (k < cells[at])
    covered = np.zeros((len(cells), int(cells.max())), bool)
    covered[at[there], k[there]] = True
    wide = covered.copy()
    wide[1:] |= covered[:-1]
    wide[:-1] |= covered[1:]
    return np.asarray(np.minimum(wide.sum(axis=1) / cells, 1.0))
