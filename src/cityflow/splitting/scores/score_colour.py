"""Lasting changes of colour at a station, on the roof and on both façades."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.splitting.scores.running_median import windowed_medians
from cityflow.splitting.strips.strip_rasters import FacadeRaster, RoofRaster

BANDS = 8
"""A roof is compared in so many bands from eaves to eaves: a change must show in most of them."""
DARK = 10.0
"""Levels below which differences drown in noise."""
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


def roof_change(roof: RoofRaster, stations: FloatArray, window_m: float, guard_m: float) -> Change | None:
    """Change of the roof's colour: the median over bands along the axis, so that dormers and chimneys have no say."""
    if roof.colour.shape[2] == 0:
        return None
    inside = np.atleast_1d(np.isfinite(roof.colour[..., 0]).any(axis=0))
    if not inside.any():
        return None
    first, last = int(np.argmax(inside)), len(inside) - int(np.argmax(inside[::-1]))
    edges = np.linspace(first, last, BANDS + 1).round().astype(int)
    bands = [
        two_sided(roof.colour[:, a:b], roof.u, stations, window_m, guard_m)
        for a, b in pairwise(edges.tolist())
        if b > a
    ]
    stack = np.stack(bands)
    enough = np.isfinite(stack).all(axis=2).sum(axis=0) >= BANDS // 2
    signed = np.full(stack.shape[1:], np.nan)
    signed[enough] = np.nanmedian(stack[:, enough], axis=0)
    return _judged(signed, roof.u, roof.colour)


def facade_changes(
    facades: Sequence[FacadeRaster], stations: FloatArray, window_m: float, guard_m: float
) -> list[Change]:
    """Change of each façade's colour in each local frame; medians over blocks of wall, which windows are too few to sway."""
    return [_judged(two_sided(s.colour, s.u, stations, window_m, guard_m), s.u, s.colour) for s in facades]


def two_sided(image: Float32Array, u: FloatArray, stations: FloatArray, window_m: float, guard_m: float) -> FloatArray:
    """(S, C) relative change of the median colour from before to after each station; NaN where either is unknown."""
    cell = float(u[1] - u[0])
    width, guard = max(round(window_m / cell), 2), round(guard_m / cell)
    least = max(int(0.12 * width * image.shape[1]), 6)
    border = np.round((stations - (u[0] - cell / 2)) / cell).astype(np.int64)
    result = np.full((len(stations), image.shape[2]), np.nan)
    for c in range(image.shape[2]):
        median = windowed_medians(np.ascontiguousarray(image[:, :, c]), width, least)
        before = _at(median, border - guard)
        after = _at(median, border + guard + width)
        result[:, c] = (after - before) / (0.5 * (after + before) + DARK)
    return result


def _at(values: Float32Array, index: np.ndarray) -> FloatArray:
    there = (index >= 0) & (index < len(values))
    result = np.full(len(index), np.nan)
    result[there] = values[index[there]]
    return result


def _judged(signed: FloatArray, u: FloatArray, image: Float32Array) -> Change:
    amount = np.abs(signed).max(axis=1) if signed.shape[1] else np.full(len(signed), np.nan)
    known = amount[np.isfinite(amount)]
    usual = float(np.quantile(known, QUIET)) / QUIET_SIGMAS if len(known) > 10 else 0.0
    return Change(amount / np.hypot(FLOOR, min(usual, 4 * FLOOR)), signed, u, image)
