"""Gaps between houses along an axis strip: no roof over most of the depth, for a metre or so (Dahlke 2017 §2.2).

In shadow the surface is unknown or falls to the ground and no segment stands; under a tree the surface is rough and its segments follow no
principal direction. Either way a gap is a run of columns that have no smooth roof, between two that have.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.splitting.strips.strip_rasters import RoofRaster

SMOOTH_M = 0.12
"""A roof is nowhere farther from the median of its surroundings, chimneys and edges aside."""
SURROUNDINGS_CELLS = 5
DEPTH_SHARE = 0.6
"""So much of a column is without a roof in a gap."""
GROUND_M = 1.8
"""What is lower above the ground is no roof."""
LOW_SHARE = 0.5
"""In points that fall into a narrow gap only here and there, what is lower than this share of the usual height is none either."""
LEAST_M, MOST_M = 0.4, 6.0
ROOF_BESIDE_M = 1.5


@dataclass(frozen=True, slots=True)
class GapStrip:
    """A gap from u_0 to u_1, metres along the strip; confidence 0 to 1."""

    u_0: float
    u_1: float
    confidence: float

    @property
    def width(self) -> float:
        return self.u_1 - self.u_0


def roofless_share(roof: RoofRaster, ground: float, leaves: bool = True) -> tuple[FloatArray, FloatArray]:
    """(U,) share of each column without a smooth roof, and (U,) number of its cells inside."""
    inside = roof.inside
    low = GROUND_M if leaves else max(GROUND_M, LOW_SHARE * _usual_height(roof, ground))
    missing = inside & ((_rough(roof.height) if leaves else ~np.isfinite(roof.height)) | ~(roof.height > ground + low))
    number = inside.sum(axis=1)
    share = np.where(number > 0, missing.sum(axis=1) / np.maximum(number, 1), 1.0)
    return share, number.astype(np.float64)


def _usual_height(roof: RoofRaster, ground: float) -> float:
    known = roof.height[roof.inside & np.isfinite(roof.height)]
    known = known[known > ground + GROUND_M]
    return float(np.median(known)) - ground if len(known) else 0.0


def find_gaps(roof: RoofRaster, ground: float, usual_depth: float, leaves: bool = True) -> list[GapStrip]:
    """Runs of columns without a roof that have roof on both sides.

    Parameters
    ----------
    leaves : what is rough is a tree; not so where heights are those of points, in which dormers and chimneys are as rough
    """
    cell = float(roof.u[1] - roof.u[0])
    share, number = roofless_share(roof, ground, leaves)
    share = cv2.blur(share.reshape(-1, 1).astype(np.float32), (1, 3)).ravel().astype(np.float64)
    deep = number * (roof.v[1] - roof.v[0]) > 0.3 * usual_depth
    open_ = deep & (share > DEPTH_SHARE)
    beside = max(int(ROOF_BESIDE_M / cell), 2)
    gaps = []
    for first, after in _runs(open_, int(0.5 / cell)):
        width = (after - first) * cell
        if not LEAST_M <= width <= MOST_M or first < beside or after + beside > len(share):
            continue
        sides = share[first - beside : first], share[after : after + beside]
        if min(float(deep[first - beside : first].mean()), float(deep[after : after + beside].mean())) < 0.7:
            continue
        worst = max(float(np.median(s)) for s in sides)
        contrast = float(share[first:after].mean()) - worst
        confidence = float(1 / (1 + np.exp(-12 * (contrast - 0.45)))) * min(1.0, width / 0.6)
        gaps.append(GapStrip(_crossing(roof.u, share, first, -1), _crossing(roof.u, share, after - 1, 1), confidence))
    return gaps


def _rough(height: Float32Array) -> BoolArray:
    """Cells that are unknown, or off the median around them."""
    known = np.isfinite(height)
    filled = np.where(known, height, np.nanmin(height) - 10.0 if known.any() else 0.0).astype(np.float32)
    smooth = cv2.medianBlur(filled, SURROUNDINGS_CELLS)
    off = np.abs(filled - smooth) > SMOOTH_M
    # leaves are rough everywhere around, edges of roofs only on a line
    dense = cv2.blur((off | ~known).astype(np.float32), (7, 7)) > 0.3
    return np.asarray(~known | dense)


def _runs(mask: BoolArray, bridge: int) -> list[tuple[int, int]]:
    """First and after-last index of runs of True; holes shorter than `bridge` are closed."""
    closed = mask.copy()
    edges = np.flatnonzero(np.diff(np.r_[False, ~mask, False].astype(np.int8)))
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        if a > 0 and b < len(mask) and b - a <= bridge:
            closed[a:b] = True
    edges = np.flatnonzero(np.diff(np.r_[False, closed, False].astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _crossing(u: FloatArray, share: FloatArray, k: int, outwards: int) -> float:
    """Where the share falls through one half, from column k outwards."""
    while 0 < k < len(share) - 1 and share[k] > 0.5:
        k += outwards
    a, b = share[k - outwards], share[k]
    part = float((a - 0.5) / (a - b)) if a > 0.5 > b else 0.0
    return float(u[k - outwards] + outwards * part * (u[1] - u[0]))
