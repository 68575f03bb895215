"""Maxima of a histogram of directions, refined by parabolas, and told apart where they overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from cityflow.core.arrays import FloatArray

MIXTURE_ROUNDS = 40
LEAST_SIGMA_DEG, MOST_SIGMA_DEG = 0.08, 2.5


@dataclass(frozen=True, slots=True)
class Peak:
    """A maximum: where, its standard deviation in degrees, and the share of weight that it has."""

    degrees: float
    sigma: float
    weight: float


def deviation_deg(values: FloatArray, centre: float, period: float) -> FloatArray:
    """Values less a centre, the shorter way round; a period of 0 means that they do not go round.

    >>> float(deviation_deg(np.array(179.0), 1.0, 180.0))
    -2.0
    """
    off = np.asarray(values, np.float64) - centre
    return off if period == 0 else (off + period / 2) % period - period / 2


def smoothed_histogram(
    values: FloatArray, weight: FloatArray, span: tuple[float, float], bin_deg: float, sigma_deg: float, circular: bool
) -> FloatArray:
    """(n,) weight per bin over `span`, smoothed."""
    count = max(round((span[1] - span[0]) / bin_deg), 4)
    histogram, _ = np.histogram(values, bins=count, range=span, weights=weight)
    width = sigma_deg / ((span[1] - span[0]) / count)
    return np.asarray(
        ndimage.gaussian_filter1d(histogram.astype(np.float64), width, mode="wrap" if circular else "constant")
    )


def peaks_of(
    histogram: FloatArray, span: tuple[float, float], circular: bool, least_share: float, most: int
) -> list[Peak]:
    """Local maxima above a share of the highest, each refined by a polynomial of degree 2 through it, highest first."""
    n = len(histogram)
    if histogram.max(initial=0.0) <= 0:
        return []
    padded = np.concatenate([histogram[-1:], histogram, histogram[:1]]) if circular else np.pad(histogram, 1)
    before, after = padded[:-2], padded[2:]
    at = np.flatnonzero((histogram > before) & (histogram >= after))
    floor = float(np.median(histogram))
    at = at[histogram[at] - floor >= least_share * (histogram.max() - floor)]
    at = at[np.lexsort((at, -histogram[at]))][:most]
    width = (span[1] - span[0]) / n
    curve = before[at] - 2 * histogram[at] + after[at]
    shift = np.where(curve < 0, 0.5 * (before[at] - after[at]) / np.minimum(curve, -1e-12), 0.0)
    sigma = np.sqrt(np.maximum(histogram[at], 0) / np.maximum(-curve, 1e-12)) * width
    centre = span[0] + (at + 0.5 + np.clip(shift, -0.5, 0.5)) * width
    return [Peak(float(c), float(s), float(h)) for c, s, h in zip(centre, sigma, histogram[at], strict=True)]


def mixture(
    values: FloatArray, weight: FloatArray, peaks: Sequence[Peak], sigma_deg: float, period: float, least_share: float
) -> list[Peak]:
    """Normal distributions about the peaks and an even background, fitted together: neighbours do not pull each other."""
    if not peaks:
        return []
    centre = np.array([p.degrees for p in peaks])
    sigma = np.full(len(peaks), sigma_deg)
    share = np.full(len(peaks) + 1, 1.0 / (len(peaks) + 1))
    even = 1.0 / (period or 70.0)
    total = weight.sum()
    for _ in range(MIXTURE_ROUNDS):
        off = np.stack([deviation_deg(values, c, period) for c in centre])
        density = share[:-1, None] / (sigma[:, None] * 2.5066) * np.exp(-0.5 * (off / sigma[:, None]) ** 2)
        part = weight * density / (density.sum(axis=0) + share[-1] * even + 1e-300)
        mass = np.maximum(part.sum(axis=1), 1e-12)
        centre = centre + (part * off).sum(axis=1) / mass
        sigma = np.clip(np.sqrt((part * off**2).sum(axis=1) / mass), LEAST_SIGMA_DEG, MOST_SIGMA_DEG)
        share = np.append(mass / total, max(1.0 - mass.sum() / total, 1e-3))
    found = [
        Peak(float(c % period if period else c), float(s), float(m / total))
        for c, s, m in zip(centre, sigma, mass, strict=True)
    ]
    found.sort(key=lambda p: (-p.weight, p.degrees))
    return _apart([p for p in found if p.weight >= least_share * found[0].weight], period)


def _apart(peaks: list[Peak], period: float) -> list[Peak]:
    """Those that are further from stronger ones than their common spread."""
    result: list[Peak] = []
    for peak in peaks:
        if all(
            abs(float(deviation_deg(np.array(peak.degrees), p.degrees, period))) > max(0.5, p.sigma) for p in result
        ):
            result.append(peak)
    return result
