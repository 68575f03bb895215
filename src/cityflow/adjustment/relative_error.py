"""How far given poses contradict each other, measured by ties of some pairs: vertical parallax, and heights where rays of two pairs meet.

An error of poses moves all ties of a pair by a smooth amount; errors of image measurement differ from tie to tie. So what a smooth function says of one
half of the ties is multiplied by what it says of the other half: errors of measurement are independent there and cancel in the mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.adjustment.pair_check import epipolar_errors
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.geometry.epipolar import intersections

STEPS = 8
"""Of the robust fit; set by hand, as are those below."""
LEAST_TIES = 30
"""Half of them still determine the six unknowns."""
SIGNIFICANT_PX = 0.25
"""Vertical parallax below which poses are not refined: exact poses under blurred and compressed pictures show 0.13 (seed 33)."""
SURE = 3.0
"""Standard deviations of what noise alone would show, beyond which it is believed."""
UNKNOWNS = 5
"""Of a relative orientation."""
LEAST_HOLD = 1e-6
"""Unknowns that ties hold less firmly than this share of the firmest stay 0: on a flat scene some cannot be told apart."""
NMAD_PER_PX = 1.45
"""GSD of surface noise for a pixel of vertical parallax: spoiled poses with 0.60 pixels raise the NMAD of the DSM from 0.52 to 1.02 GSD (docs/results.md)."""


@dataclass(frozen=True, slots=True)
class Systematic:
    """The smooth part of some values.

    Attributes
    ----------
    square : its mean square, in the square of their unit; negative where noise alone made it
    noise : robust standard deviation of the rest
    count : number of values
    """

    square: float
    noise: float
    count: int


@dataclass(frozen=True, slots=True)
class RelativeError:
    """Of the poses of a sample.

    Attributes
    ----------
    parallax_px : vertical parallax by poses, root mean square;  sure_px : the least that is no noise of the sample
    noise_px : of the image measurement, vertical
    height_gsd : how far heights of two pairs with a common image differ by poses, root mean square; NaN where no three images have ties in common
    pairs, tied : pairs that were looked at, and those whose images have enough ties
    ties : of these
    """

    parallax_px: float
    sure_px: float
    noise_px: float
    height_gsd: float
    pairs: int
    tied: int
    ties: int

    @property
    def is_significant(self) -> bool:
        """Whether poses should be refined; also where most pairs have no ties where poses have them."""
        if not self.tied:
            return False
        return 2 * self.tied < self.pairs or self.parallax_px >= max(SIGNIFICANT_PX, self.sure_px)

    @property
    def expected_nmad_gsd(self) -> float:
        """Noise of the surface by poses alone, in ground pixels, in proportion to what was measured."""
        return NMAD_PER_PX * self.parallax_px


def systematic(slopes: FloatArray, values: FloatArray) -> Systematic:
    """What a function of few unknowns says of values with noise and single blunders.

    Parameters
    ----------
    slopes : (N, K) of the function; N at least `LEAST_TIES`
    values : (N,)
    """
    half = np.arange(len(values)) % 2 == 0
    one, other = (slopes @ _fitted(slopes[h], values[h]) for h in (half, ~half))
    rest = values - (one + other) / 2
    return Systematic(float(np.mean(one * other)), _spread(rest), len(values))


def parallax_of(images: tuple[OrientedImage, OrientedImage], uv: tuple[FloatArray, FloatArray]) -> Systematic | None:
    """Vertical parallax of the ties of a pair, pixels of the second image; None where there are too few.

    Parameters
    ----------
    uv : (N, 2) image coordinates in each image, pixels
    """
    if len(uv[0]) < LEAST_TIES:
        return None
    values, slopes = epipolar_errors(images, uv)
    return systematic(slopes, values)


def height_difference(
    images: tuple[OrientedImage, OrientedImage, OrientedImage], uv: tuple[FloatArray, FloatArray, FloatArray]
) -> Systematic | None:
    """Heights at which rays of the first and second image meet, less those of the first and third, metres; None where there are too few.

    Parameters
    ----------
    uv : (N, 2) image coordinates of the same places in each image, pixels
    """
    first, *others = images
    met = [_met((first, other), (uv[0], seen)) for other, seen in zip(others, uv[1:], strict=True)]
    values = met[0][:, 2] - met[1][:, 2]
    known = np.isfinite(values)
    if known.sum() < LEAST_TIES:
        return None
    size = max(first.camera.width, first.camera.height)
    x, y = ((uv[0][known] - (first.camera.cx, first.camera.cy)) / size).T
    return systematic(np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y]), values[known])


def combined(parallax: Sequence[Systematic | None], heights_gsd: Sequence[Systematic | None]) -> RelativeError:
    """Of all pairs of a sample, and of all triples of images; None where there are too few ties."""
    found = [p for p in parallax if p is not None]
    if not found:
        return RelativeError(0.0, 0.0, 0.0, float("nan"), len(parallax), 0, 0)
    count, noise = np.array([(p.count, p.noise) for p in found], np.float64).T
    mean = float(np.average([p.square for p in found], weights=count))
    # noise alone: the product of two functions of `UNKNOWNS` unknowns, each of half the ties
    alone = float(np.sqrt(np.sum(UNKNOWNS * (2 * noise**2) ** 2)) / count.sum())
    met = [h for h in heights_gsd if h is not None]
    height = _root(float(np.average([h.square for h in met], weights=[h.count for h in met]))) if met else float("nan")
    rest = float(np.sqrt(np.average(noise**2, weights=count)))
    return RelativeError(_root(mean), _root(SURE * alone), rest, height, len(parallax), len(found), int(count.sum()))


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


def _fitted(slopes: FloatArray, values: FloatArray) -> FloatArray:
    """(K,) unknowns, by least squares with Cauchy's loss."""
    unknowns: FloatArray = np.zeros(slopes.shape[1])
    left = values
    for _ in range(STEPS):
        root = 1.0 / np.hypot(1.0, left / (2.0 * max(_spread(left), 1e-6)))
        unknowns = np.asarray(np.linalg.lstsq(slopes * root[:, None], values * root, rcond=LEAST_HOLD)[0])
        left = values - slopes @ unknowns
    return unknowns


def _spread(values: FloatArray) -> float:
    return 1.4826 * float(np.median(np.abs(values)))


def _met(images: tuple[OrientedImage, OrientedImage], uv: tuple[FloatArray, FloatArray]) -> FloatArray:
    """(N, 3) where rays of both images meet."""
    count = len(uv[0])
    point = np.repeat(np.arange(count), 2)
    image = np.tile(np.array([0, 1]), count)
    return intersections(images, point, image, np.stack(uv, axis=1).reshape(-1, 2))
