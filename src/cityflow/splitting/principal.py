"""Principal directions of a complex: main and side maxima of aspect, and slopes (Dahlke 2017 §2.1, Fig. 2 and 4)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Direction
from cityflow.core.parameters import Parameters
from cityflow.core.splitting import Segments
from cityflow.splitting.principal_histogram import (
    Peak,
    deviation_deg,
    mixture,
    peaks_of,
    smoothed_histogram,
)

UPRIGHT_DEG, LEVEL_DEG = 80.0, 10.0
RIGHT_DEG = 90.0


class PrincipalParameters(Parameters):
    """How principal directions are told from the rest."""

    bin_deg: float = Field(0.25, gt=0, le=2, description="width of a bin of the histogram of aspects, degrees")
    resolution_deg: float = Field(
        0.6, gt=0, le=5, description="standard deviation that aspects are smoothed with, degrees"
    )
    slope_resolution_deg: float = Field(1.5, gt=0, le=5, description="the same for slopes, degrees")
    least_share: float = Field(0.08, gt=0, le=1, description="a side maximum's weight over that of the main one")
    least_slope_share: float = Field(0.15, gt=0, le=1, description="the same for slopes")
    most_aspects: int = Field(8, ge=1, le=40, description="orientations that are told apart")
    most_slopes: int = Field(6, ge=1, le=40, description="slopes that are told apart")
    right_deg: float = Field(1.5, gt=0, le=10, description="how far two aspects may be off a right angle, degrees")
    least_weight: float = Field(
        0.35, ge=0, le=1, description="share of length that follows principal aspects when all is well"
    )
    least_segments: int = Field(12, ge=1, le=10000, description="fewer segments with an aspect tell nothing")
    aspect_deg: float = Field(2.0, gt=0, le=20, description="how far off its aspect a segment may be, degrees")
    slope_deg: float = Field(4.0, gt=0, le=30, description="how far off a principal slope a segment may be, degrees")
    position_m: float = Field(
        0.06, ge=0, le=1, description="uncertainty of a segment's ends: short ones may be off more, metres"
    )


@dataclass(frozen=True, slots=True)
class Principal:
    """Principal directions of a complex.

    Attributes
    ----------
    aspects : strongest first; an aspect and its perpendicular are two
    slopes : between level and upright, strongest first
    good : whether two aspects stand at a right angle, and enough follows them
    reason : why not; empty where all is well
    orientation : for each aspect the orientation that it belongs to; perpendicular aspects share one. 0 is the strongest
    votes : for each orientation the numbers of the segments that follow it
    """

    aspects: tuple[Direction, ...]
    slopes: tuple[Direction, ...]
    good: bool
    reason: str
    orientation: tuple[int, ...] = ()
    votes: tuple[IntArray, ...] = field(default=(), repr=False)


def principal_directions(segments: Segments, parameters: PrincipalParameters) -> Principal:
    """Maxima of aspect over all segments, and of slope over those with a principal aspect.

    Aspects are looked at modulo 90° first, so that a part of the complex and its perpendicular speak with one voice; a
    mixture of normal distributions then separates orientations that are two or three degrees apart.
    """
    with_aspect = np.flatnonzero(segments.slope_deg <= UPRIGHT_DEG)
    if len(with_aspect) < parameters.least_segments:
        return Principal((), (), False, "too few segments to tell directions")
    aspect, weight = segments.aspect_deg[with_aspect], _weights(segments, with_aspect)
    orientations = _orientations(aspect, weight, parameters)
    if not orientations:
        return Principal((), (), False, "no direction stands out")
    of = _nearest(aspect % RIGHT_DEG, orientations, parameters.aspect_deg, RIGHT_DEG)
    aspects, belongs = _aspects(aspect, weight, of, orientations)
    slopes = _slopes(segments.take(with_aspect[of >= 0]), parameters)
    votes = tuple(with_aspect[of == k] for k in range(len(orientations)))
    reason = _doubt(aspects, belongs, weight[of >= 0].sum() / weight.sum(), parameters)
    return Principal(aspects, slopes, not reason, reason, belongs, votes)


def local_aspect(
    segments: Segments, xy: FloatArray, radius: float, parameters: PrincipalParameters | None = None
) -> tuple[Direction, ...]:
    """The strongest aspect around a place and its perpendicular where it has one; none where nothing stands out.

    Parameters
    ----------
    xy : (2,) world metres
    radius : metres; segments whose middle is nearer count
    """
    middle = 0.5 * (segments.start + segments.end)[:, :2]
    near = segments.take(np.linalg.norm(middle - xy, axis=1) <= radius)
    found = principal_directions(near, parameters or PrincipalParameters())
    return tuple(a for a, k in zip(found.aspects, found.orientation, strict=True) if k == 0)


def filtered(segments: Segments, principal: Principal, parameters: PrincipalParameters) -> Segments:
    """Without what is off the principal directions. Upright segments stay: their aspect has no meaning."""
    return segments.take(kept(segments, principal, parameters))


def kept(segments: Segments, principal: Principal, parameters: PrincipalParameters) -> BoolArray:
    """(N,) segments that are upright, or level in a principal aspect, or of a principal aspect and a principal slope."""
    slope, aspect = segments.slope_deg, segments.aspect_deg
    plan = np.maximum(segments.length * np.cos(np.radians(slope)), 1e-6)
    loose = np.degrees(np.arctan(parameters.position_m / plan))
    aspect_fits = _fits(
        aspect, principal.aspects, parameters.aspect_deg + np.minimum(loose, parameters.aspect_deg), 180.0
    )
    steep = np.degrees(np.arctan(parameters.position_m / np.maximum(segments.length, 1e-6)))
    slope_fits = _fits(slope, principal.slopes, parameters.slope_deg + np.minimum(steep, parameters.slope_deg), 0.0)
    level = slope < LEVEL_DEG
    return (slope > UPRIGHT_DEG) | (aspect_fits & (level | slope_fits))


def _fits(values: FloatArray, directions: tuple[Direction, ...], tolerance: FloatArray, period: float) -> BoolArray:
    result = np.zeros(len(values), bool)
    for d in directions:
        result |= np.abs(deviation_deg(values, d.degrees, period)) <= tolerance
    return result


def _weights(segments: Segments, chosen: IntArray) -> FloatArray:
    """Length in plan: what a line says of its direction."""
    return segments.length[chosen] * np.cos(np.radians(segments.slope_deg[chosen]))


def _orientations(aspect: FloatArray, weight: FloatArray, parameters: PrincipalParameters) -> list[Peak]:
    """Orientations modulo 90°, strongest first."""
    folded = aspect % RIGHT_DEG
    histogram = smoothed_histogram(
        folded, weight, (0.0, RIGHT_DEG), parameters.bin_deg, parameters.resolution_deg, True
    )
    peaks = peaks_of(histogram, (0.0, RIGHT_DEG), True, parameters.least_share, parameters.most_aspects)
    return mixture(folded, weight, peaks, parameters.resolution_deg, RIGHT_DEG, parameters.least_share)


def _nearest(values: FloatArray, peaks: list[Peak], within: float, period: float) -> IntArray:
    """(N,) number of the peak that each value is nearest to, -1 beyond `within`."""
    off = np.abs(np.stack([deviation_deg(values, p.degrees, period) for p in peaks]))
    nearest = np.argmin(off, axis=0)
    return np.where(off.min(axis=0) <= within, nearest, -1)


def _aspects(
    aspect: FloatArray, weight: FloatArray, of: IntArray, orientations: list[Peak]
) -> tuple[tuple[Direction, ...], tuple[int, ...]]:
    """Each orientation's two aspects, as far as segments have them, strongest first."""
    found: list[tuple[Direction, int]] = []
    for k, peak in enumerate(orientations):
        for turn in (0.0, RIGHT_DEG):
            centre = peak.degrees + turn
            off = deviation_deg(aspect, centre, 180.0)
            mine = (of == k) & (np.abs(off) < RIGHT_DEG / 2)
            total = weight[mine].sum()
            if total < 0.02 * weight[of == k].sum():
                continue
            degrees = centre + _centre(off[mine], weight[mine], peak.sigma)
            spread = float(np.sqrt(np.average((off[mine]) ** 2, weights=weight[mine])))
            found.append((Direction(float(degrees % 180), spread, float(total / weight.sum())), k))
    found.sort(key=lambda f: (-f[0].weight, f[0].degrees))
    return tuple(f[0] for f in found), tuple(f[1] for f in found)


def _centre(off: FloatArray, weight: FloatArray, sigma: float) -> float:
    """Mean that far values do not pull."""
    centre = 0.0
    for _ in range(10):
        near = weight * np.exp(-0.5 * ((off - centre) / max(sigma, 0.3)) ** 2)
        centre = float((near * off).sum() / max(near.sum(), 1e-12))
    return centre


def _slopes(segments: Segments, parameters: PrincipalParameters) -> tuple[Direction, ...]:
    slope, weight = segments.slope_deg, segments.length
    inside = (slope > LEVEL_DEG) & (slope < UPRIGHT_DEG)
    slope, weight = slope[inside], weight[inside]
    if not len(slope):
        return ()
    span = (LEVEL_DEG, UPRIGHT_DEG)
    histogram = smoothed_histogram(slope, weight, span, 0.5, parameters.slope_resolution_deg, False)
    peaks = peaks_of(histogram, span, False, parameters.least_slope_share, parameters.most_slopes)
    found = mixture(slope, weight, peaks, parameters.slope_resolution_deg, 0.0, parameters.least_slope_share)
    return tuple(Direction(p.degrees, p.sigma, p.weight) for p in found)


def _doubt(
    aspects: tuple[Direction, ...], belongs: tuple[int, ...], share: float, parameters: PrincipalParameters
) -> str:
    """Why the directions should not be trusted; empty where they may."""
    main = [a.degrees for a, k in zip(aspects, belongs, strict=True) if k == 0]
    if len(main) < 2:
        return "no aspect has a perpendicular one"
    off = abs(abs(float(deviation_deg(np.array(main[0]), main[1], 180.0))) - RIGHT_DEG)
    if off > parameters.right_deg:
        return f"the main aspects are {off:.1f}° off a right angle"
    if share < parameters.least_weight:
        return f"only {share:.0%} of the segments' length follows principal aspects"
    if len(set(belongs)) >= parameters.most_aspects:
        return f"{len(set(belongs))} orientations or more: a curved row"
    return ""
