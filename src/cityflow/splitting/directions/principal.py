"""Principal directions of a complex: main and side maxima of aspect, and slopes (Dahlke 2017 §2.1, Fig. 2 and 4)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Direction
from cityflow.core.splitting import Segments
from cityflow.splitting.directions.principal_histogram import (
    Peak,
    Sample,
    apart,
    density,
    deviation_deg,
    mixture,
    peaks_of,
)
from cityflow.splitting.directions.principal_spread import LEVEL_DEG, UPRIGHT_DEG, aspect_sigma_deg, slope_sigma_deg

RIGHT_DEG = 90.0
SURE_VOTE = 0.6


BIN_DEG = 0.25
"""Width of a bin of the histograms."""
METRE_SIGMA_DEG = 4.0
"""Standard deviation of the direction of a segment of one metre, before it is estimated from the data."""
LEAST_SHARE, LEAST_SLOPE_SHARE = 0.08, 0.15
"""Least weight of a further maximum of orientations, or of slopes, as a share of that of the main one."""
LEAST_APART_DEG, MOST_ASPECTS, MOST_SLOPES = 1.2, 12, 6
"""Maxima of aspect that are nearer are one; largest number of orientations and of slopes."""
LEAST_SEGMENTS = 6
"""Fewer segments with a direction give no main directions."""
ASPECT_DEG, SLOPE_DEG, POSITION_M = 2.0, 4.0, 0.06
"""Largest deviation of a segment from its main direction and slope; uncertainty of its ends: short ones may be off more."""


@dataclass(frozen=True, slots=True)
class Principal:
    """Principal directions of a complex.

    Attributes
    ----------
    aspects : strongest first; an aspect and its perpendicular are two. `sigma` is that of the direction, not of its lines
    slopes : between level and upright, strongest first
    orientation : for each aspect the orientation that it belongs to; perpendicular aspects share one. 0 is the strongest
    votes : for each orientation the numbers of the segments that follow it and no other
    """

    aspects: tuple[Direction, ...]
    slopes: tuple[Direction, ...]
    orientation: tuple[int, ...] = ()
    votes: tuple[IntArray, ...] = field(default=(), repr=False)

    def aspects_of(self, orientation: int) -> tuple[Direction, ...]:
        """The one or two aspects of an orientation, strongest first."""
        return tuple(a for a, k in zip(self.aspects, self.orientation, strict=True) if k == orientation)


def principal_directions(segments: Segments) -> Principal:
    """Maxima of aspect over all segments, and of slope over those with a principal aspect.

    Aspects are looked at modulo 90° first, so that a part of the complex and its perpendicular add up; a
    mixture of normal distributions then separates orientations that are two or three degrees apart.
    """
    chosen = np.flatnonzero(segments.slope_deg <= UPRIGHT_DEG)
    if len(chosen) < LEAST_SEGMENTS:
        return Principal((), ())
    part = segments.take(chosen)
    weight = part.length * np.cos(np.radians(part.slope_deg))
    sigma, peaks = _orientations(part, weight)
    if not peaks:
        return Principal((), ())
    peaks, belongs = mixture(_folded(part, weight, sigma), peaks)
    aspects, of = _aspects(part.aspect_deg, weight, sigma, peaks, belongs)
    follows = belongs.sum(axis=0) >= 0.5
    slopes = _slopes(part.take(follows))
    votes = tuple(chosen[b >= SURE_VOTE] for b in belongs)
    return Principal(aspects, slopes, of, votes)


def orientation_at(segments: Segments, principal: Principal, xy: FloatArray, radius: float) -> int:
    """The orientation that most of the segments' length around a place follows; -1 where none votes.

    Parameters
    ----------
    segments : those that `principal` was found from
    xy : (2,) world metres
    radius : metres; half as far counts half as much again
    """
    middle = 0.5 * (segments.start + segments.end)[:, :2]
    near = np.exp(-0.5 * (np.linalg.norm(middle - np.asarray(xy), axis=1) / radius) ** 2) * segments.length
    heard = np.array([near[v].sum() for v in principal.votes])
    return int(np.argmax(heard)) if heard.max(initial=0.0) > 1e-3 else -1


def filtered(segments: Segments, principal: Principal) -> Segments:
    """Without what is off the principal directions. Upright segments stay: their aspect has no meaning."""
    return segments.take(follows_principal(segments, principal))


def follows_principal(segments: Segments, principal: Principal) -> BoolArray:
    """(N,) segments that are upright, or level in a principal aspect, or of a principal aspect and a principal slope."""
    slope = segments.slope_deg
    plan = np.maximum(segments.length * np.cos(np.radians(slope)), 1e-6)
    loose = np.minimum(np.degrees(np.arctan(POSITION_M / plan)), ASPECT_DEG)
    aspect_fits = _fits(segments.aspect_deg, principal.aspects, ASPECT_DEG + loose, 180.0)
    loose = np.degrees(np.arctan(POSITION_M / np.maximum(segments.length, 1e-6)))
    slope_fits = _fits(slope, principal.slopes, SLOPE_DEG + np.minimum(loose, SLOPE_DEG), 0.0)
    return np.asarray((slope > UPRIGHT_DEG) | (aspect_fits & ((slope < LEVEL_DEG) | slope_fits)))


def _fits(values: FloatArray, directions: tuple[Direction, ...], tolerance: FloatArray, period: float) -> BoolArray:
    result = np.zeros(len(values), bool)
    for d in directions:
        result |= np.abs(deviation_deg(values, d.degrees, period)) <= tolerance
    return result


def _folded(segments: Segments, weight: FloatArray, sigma: FloatArray) -> Sample:
    return Sample(segments.aspect_deg % RIGHT_DEG, weight, sigma, (0.0, RIGHT_DEG), True)


def _orientations(segments: Segments, weight: FloatArray) -> tuple[FloatArray, list[Peak]]:
    """Standard deviations of the segments' aspects, first by their length alone, then as each local frame's own scatter tells;
    and the maxima modulo 90°, strongest first."""
    sigma, peaks = aspect_sigma_deg(segments, None, METRE_SIGMA_DEG), list[Peak]()
    for _ in range(2):
        sample = _folded(segments, weight, sigma)
        histogram = density(sample, BIN_DEG)
        peaks = peaks_of(histogram, sample.span, True, LEAST_SHARE, MOST_ASPECTS)
        peaks = apart(mixture(sample, peaks)[0], RIGHT_DEG, LEAST_APART_DEG)
        peaks = [p for p in peaks if p.weight >= LEAST_SHARE * peaks[0].weight]
        if not peaks:
            break
        off = np.stack([deviation_deg(sample.degrees, p.degrees, RIGHT_DEG) for p in peaks])
        nearest = off[np.argmin(np.abs(off), axis=0), np.arange(off.shape[1])]
        sigma = aspect_sigma_deg(segments, nearest, METRE_SIGMA_DEG)
    return sigma, peaks


def _aspects(
    aspect: FloatArray, weight: FloatArray, sigma: FloatArray, peaks: list[Peak], shares: FloatArray
) -> tuple[tuple[Direction, ...], tuple[int, ...]]:
    """Each orientation's two aspects, as far as segments have them, strongest first."""
    found: list[tuple[Direction, int]] = []
    for k, (peak, belongs) in enumerate(zip(peaks, shares, strict=True)):
        for turn in (0.0, RIGHT_DEG):
            off = deviation_deg(aspect, peak.degrees + turn, 180.0)
            mine = belongs * (np.abs(off) < RIGHT_DEG / 2)
            share = float((mine * weight).sum() / weight.sum())
            exact = mine / sigma**2
            if share < 0.03 * peak.weight or exact.sum() <= 0:
                continue
            own, own_sigma = float((exact * off).sum() / exact.sum()), float(1 / np.sqrt(exact.sum()))
            # a wall's lines and its perpendicular's tell of one orientation, as long as they do not contradict
            turned = own if abs(own) > 3 * own_sigma + 0.2 else 0.0
            deviation = own_sigma if turned else peak.sigma
            found.append((Direction(float((peak.degrees + turn + turned) % 180), deviation, share), k))
    found.sort(key=lambda f: (-f[0].weight, f[0].degrees))
    return tuple(f[0] for f in found), tuple(f[1] for f in found)


def _slopes(segments: Segments) -> tuple[Direction, ...]:
    slope = segments.slope_deg
    inside = (slope > LEVEL_DEG) & (slope < UPRIGHT_DEG)
    if not inside.any():
        return ()
    part, span = segments.take(inside), (LEVEL_DEG, UPRIGHT_DEG)
    sample = Sample(slope[inside], part.length, slope_sigma_deg(part, METRE_SIGMA_DEG), span, False)
    histogram = density(sample, BIN_DEG)
    peaks = peaks_of(histogram, span, False, LEAST_SLOPE_SHARE, MOST_SLOPES)
    found = apart(mixture(sample, peaks)[0], 0.0, 2 * LEAST_APART_DEG)
    found = [p for p in found if p.weight >= LEAST_SLOPE_SHARE * found[0].weight]
    return tuple(Direction(p.degrees, p.sigma, p.weight) for p in found)
