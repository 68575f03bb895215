"""Lasting changes of colour at a station, on the roof and on both façades."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.splitting.scores.border_sides import DARK, LEAST_KNOWN
from cityflow.splitting.scores.medians import medians_beside, middle_of_known
from cityflow.splitting.strips.strip_rasters import FacadeRaster, RoofRaster

BANDS = 8
"""A roof is compared in so many bands from eaves to eaves: a change must show in most of them."""
FLOOR = 0.025
"""Relative change that texture alone makes where nothing else tells."""
QUIET, QUIET_SIGMAS = 0.4, 0.7
"""Quantile of changes over all stations, and how many standard deviations it is where a good part of them are true."""


@dataclass(frozen=True, slots=True)
class Change:
    """What one source says at every station.

    Attributes
    ----------
    significance : (S,) relative change of the colour that differs most over its usual size where nothing changes; NaN where nothing is known
    signed : (S, C) the change of each colour
    u : (U,) columns of the image;  image : (U, Z, C) levels
    """

    significance: FloatArray
    signed: FloatArray
    u: FloatArray
    image: Float32Array

    @property
    def seen(self) -> float:
        """Share of the image that is known."""
        return float(np.isfinite(self.image[..., 0]).mean()) if self.image.size else 0.0


def roof_changes(roof: RoofRaster, stations: FloatArray, window_m: float, guard_m: float) -> Change | None:
    """Change of the roof's colour: the median over bands along the axis, so that dormers and chimneys have no say."""
    if not np.isfinite(roof.colour[..., :1]).any():
        return None
    bands = _along(roof.colour, roof.u, stations, bands_of(roof.colour), (window_m, guard_m))
    enough = np.isfinite(bands).all(axis=2).sum(axis=1) >= BANDS // 2
    signed = np.full((len(stations), bands.shape[2]), np.nan)
    signed[enough] = middle_of_known(bands[enough].swapaxes(0, 1))
    return _judged(signed, roof.u, roof.colour)


def bands_of(image: Float32Array) -> IntArray:
    """(BANDS + 1,) edges of the bands between the first and the last column of an image (U, V, C) that is known as far as half the usual: a bay adds none."""
    known = np.isfinite(image[..., 0]).sum(axis=0)
    inside = np.flatnonzero(known >= 0.5 * np.median(known[known > 0]))
    return np.asarray(np.linspace(inside[0], inside[-1] + 1, BANDS + 1).round(), np.int64)


def facade_changes(
    facades: Sequence[FacadeRaster], stations: FloatArray, window_m: float, guard_m: float
) -> list[Change]:
    """Change of each façade's colour in each local frame; medians over blocks of wall, which windows are too few to sway."""
    edges = [np.array([0, f.colour.shape[1]], np.int64) for f in facades]
    return [
        _judged(_along(f.colour, f.u, stations, e, (window_m, guard_m))[:, 0], f.u, f.colour)
        for f, e in zip(facades, edges, strict=True)
    ]


def _along(
    image: Float32Array, u: FloatArray, stations: FloatArray, edges: IntArray, reach: tuple[float, float]
) -> FloatArray:
    """(S, B, C) relative change from before to after each station; NaN where either is unknown."""
    side, guard = reach
    ends = np.searchsorted(u, stations[:, None] + np.array([-side, -guard, guard, side]))
    sides = (np.ascontiguousarray(ends[:, of]) for of in (slice(2), slice(2, 4)))
    low, high = (medians_beside(image, columns, edges, LEAST_KNOWN) for columns in sides)
    change = (high - low) / (0.5 * (high + low) + DARK)
    change[(ends[:, [1, 3]] - ends[:, [0, 2]] < 2).any(axis=1)] = np.nan
    return np.asarray(change)


def _judged(signed: FloatArray, u: FloatArray, image: Float32Array) -> Change:
    amount = np.abs(signed).max(axis=1) if signed.shape[1] else np.full(len(signed), np.nan)
    known = amount[np.isfinite(amount)]
    usual = float(np.quantile(known, QUIET)) / QUIET_SIGMAS if len(known) > 10 else 0.0
    return Change(amount / np.hypot(FLOOR, min(usual, 4 * FLOOR)), signed, u, image)
