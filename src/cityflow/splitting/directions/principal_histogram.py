"""Maxima of a histogram of directions, refined by parabolas, and separated where they overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from cityflow.core.arrays import FloatArray

MIXTURE_ROUNDS = 30
SIGMA_CLASSES = 8
OWN_SIGMA_DEG = 0.1
"""Lines of one orientation differ by so much among themselves: no house is built better."""


@dataclass(frozen=True, slots=True)
class Peak:
    """A maximum: where, its standard deviation in degrees, and the share of weight that it has."""

    degrees: float
    sigma: float
    weight: float


@dataclass(frozen=True, slots=True)
class Sample:
    """Directions of lines.

    Attributes
    ----------
    degrees : (N,) within `span`
    weight : (N,) how much each counts
    sigma : (N,) standard deviation of each, degrees
    span : degrees
    circular : whether the end of the span is its beginning
    """

    degrees: FloatArray
    weight: FloatArray
    sigma: FloatArray
    span: tuple[float, float]
    circular: bool

    @property
    def period(self) -> float:
        """Degrees after which values come again; 0 where they do not."""
        return self.span[1] - self.span[0] if self.circular else 0.0


def deviation_deg(values: FloatArray, centre: float | FloatArray, period: float) -> FloatArray:
    """Values less a centre, the shorter way round; a period of 0 means that they do not go round.

    >>> float(deviation_deg(np.array(179.0), 1.0, 180.0))
    -2.0
    """
    off = np.asarray(values, np.float64) - centre
    return np.asarray(off if period == 0 else (off + period / 2) % period - period / 2)


def density(sample: Sample, bin_deg: float) -> FloatArray:
    """(n,) histogram of weights over the span, in which each direction is as wide as it is uncertain."""
    count = max(round((sample.span[1] - sample.span[0]) / bin_deg), 8)
    width = (sample.span[1] - sample.span[0]) / count
    edges = np.geomspace(OWN_SIGMA_DEG, max(float(sample.sigma.max(initial=1.0)), 1.0), SIGMA_CLASSES)
    of = np.argmin(np.abs(np.log(sample.sigma[:, None] / edges)), axis=1)
    total = np.zeros(count)
    for k, sigma in enumerate(edges):
        part, _ = np.histogram(sample.degrees[of == k], count, sample.span, weights=sample.weight[of == k])
        # half a degree at least: a histogram of few lines is ragged
        wide = np.hypot(sigma, 0.5) / width
        total += ndimage.gaussian_filter1d(
            part.astype(np.float64), wide, mode="wrap" if sample.circular else "constant"
        )
    return total


def peaks_of(histogram: FloatArray, span: tuple[float, float], circular: bool, share: float, most: int) -> list[Peak]:
    """Local maxima that rise above the rest by a share of the highest, each refined by a polynomial of degree 2, highest first."""
    n = len(histogram)
    if histogram.max(initial=0.0) <= 0:
        return []
    padded = np.concatenate([histogram[-1:], histogram, histogram[:1]]) if circular else np.pad(histogram, 1)
    before, after = padded[:-2], padded[2:]
    at = np.flatnonzero((histogram > before) & (histogram >= after))
    floor = float(np.median(histogram))
    at = at[histogram[at] - floor >= share * (histogram.max() - floor)]
    at = at[np.lexsort((at, -histogram[at]))][:most]
    width = (span[1] - span[0]) / n
    curve = before[at] - 2 * histogram[at] + after[at]
    shift = np.where(curve < 0, 0.5 * (before[at] - after[at]) / np.minimum(curve, -1e-12), 0.0)
    sigma = np.sqrt(np.maximum(histogram[at], 0) / np.maximum(-curve, 1e-12)) * width
    centre = span[0] + (at + 0.5 + np.clip(shift, -0.5, 0.5)) * width
    return [Peak(float(c), float(s), float(h)) for c, s, h in zip(centre, sigma, histogram[at], strict=True)]


def mixture(sample: Sample, peaks: Sequence[Peak]) -> tuple[list[Peak], FloatArray]:
    """Normal distributions about the peaks and an even background, fitted together: neighbours do not pull each other.

    Returns
    -------
    The peaks as fitted, in the order given; `sigma` is the standard deviation of the centre. And (K, N) the probability
    that each direction belongs to each of them.
    """
    if not peaks:
        return [], np.empty((0, len(sample.degrees)))
    centre = np.array([p.degrees for p in peaks])
    share = np.full(len(peaks) + 1, 1.0 / (len(peaks) + 1))
    even = 1.0 / (sample.span[1] - sample.span[0])
    total = max(float(sample.weight.sum()), 1e-12)
    belongs = np.zeros((len(peaks), len(sample.degrees)))
    precision = np.ones(len(peaks))
    for _ in range(MIXTURE_ROUNDS):
        off = np.stack([deviation_deg(sample.degrees, c, sample.period) for c in centre])
        likely = share[:-1, None] / sample.sigma * np.exp(-0.5 * (off / sample.sigma) ** 2) / np.sqrt(2 * np.pi)
        belongs = likely / (likely.sum(axis=0) + share[-1] * even + 1e-300)
        exact = belongs / sample.sigma**2
        precision = np.maximum(exact.sum(axis=1), 1e-12)
        centre = centre + np.clip((exact * off).sum(axis=1) / precision, -1.0, 1.0)
        mass = (belongs * sample.weight).sum(axis=1)
        share = np.append(mass / total, max(1.0 - mass.sum() / total, 1e-3))
    fitted = [
        Peak(float(c % sample.period if sample.circular else c), float(1.0 / np.sqrt(p)), float(s))
        for c, p, s in zip(centre, precision, share[:-1], strict=True)
    ]
    return fitted, belongs


def apart(peaks: Sequence[Peak], period: float, least_deg: float) -> list[Peak]:
    """Strongest first, without those nearer than `least_deg` to a stronger one."""
    result: list[Peak] = []
    for peak in sorted(peaks, key=lambda p: (-p.weight, p.degrees)):
        if all(abs(float(deviation_deg(np.array(peak.degrees), p.degrees, period))) >= least_deg for p in result):
            result.append(peak)
    return result
