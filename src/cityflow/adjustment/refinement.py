"""Given poses, refined by tie points where those that were kept out of the adjustment agree better afterwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.adjustment.block import Block, residuals
from cityflow.adjustment.bundle import Adjusted, AdjustmentParameters, adjusted
from cityflow.adjustment.tracks import Ties, spread
from cityflow.adjustment.triangulation import triangulated
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import OrientedImage

KEPT_OUT = 5
"""Every so many-th tie point is kept out of the adjustment, to judge it; set by hand, as are those below."""
CELLS = 12
"""Of the grid in which the tie points of an image are spread, along its longer side."""
LEAST_GAIN_PX = 0.1
"""Poses that are off by less are left as they are."""
SURE = 2.0
"""Standard deviations by which the gain must differ from nothing."""
CAPPED = 4.0
"""Residuals count up to this multiple of their usual size, so that mismatches do not judge."""
FEW_TIES = 20
"""An image with fewer observations is weak."""
WEAK_PX = 0.5
"""And one whose pose stays less certain than this, in its pixels."""


@dataclass(frozen=True, slots=True)
class Gain:
    """What the adjustment does to tie points that it did not know.

    Attributes
    ----------
    before_px, after_px : root mean square of their reprojection errors, single ones capped
    error_px : of the given poses in the images: root of the difference of the squares, 0 where nothing was gained
    score : mean gain of an image over its standard deviation
    """

    before_px: float
    after_px: float
    error_px: float
    score: float

    @property
    def is_significant(self) -> bool:
        return self.error_px >= LEAST_GAIN_PX and self.score >= SURE


@dataclass(frozen=True, slots=True)
class Refinement:
    """The outcome.

    Attributes
    ----------
    given, images : in the same order, as they were and as they are now: the same where the gain is not significant
    covariances : (N, 6, 6) of `images`: rotation vectors in the camera frames (radians), centres (metres); of poses that stay, what the adjustment says
        of all given ones
    gain : on tie points that were kept out
    adjusted : the block;  origin : (3,) of its coordinates
    observations : (N,) of each image;  sigma_px : (N,) of each pose in its pixels, on the ground
    weak : names of images whose pose the ties do not hold
    """

    given: tuple[OrientedImage, ...]
    images: tuple[OrientedImage, ...]
    covariances: FloatArray
    gain: Gain
    adjusted: Adjusted
    origin: FloatArray
    observations: IntArray
    sigma_px: FloatArray
    weak: tuple[str, ...]

    @property
    def xyz(self) -> FloatArray:
        """(P, 3) tie points, world metres."""
        return self.adjusted.block.xyz + self.origin


def refined(images: Sequence[OrientedImage], ties: Ties, parameters: AdjustmentParameters) -> Refinement:
    """Refine poses.

    Raises
    ------
    ValueError
        The ties hold no block.
    """
    origin = np.asarray(np.round(np.mean([i.centre for i in images], axis=0)), np.float64)
    given = Block.of(images, origin)
    chosen = spread(ties, [(i.camera.width, i.camera.height) for i in images], CELLS)
    out = np.arange(chosen.points) % KEPT_OUT == KEPT_OUT - 1
    found = adjusted(given, chosen.of_points(~out), parameters)
    gain = gained(given, found.block, chosen.of_points(out))
    names = [i.name for i in images]
    observations = np.bincount(found.ties.image, minlength=len(images))
    sigma = _in_pixels(found)
    weak = tuple(n for n, o, s in zip(names, observations, sigma, strict=True) if o < FEW_TIES or s > WEAK_PX)
    poses, covariances = tuple(images), found.covariances
    if gain.is_significant:
        poses = tuple(found.block.image(k, name, origin) for k, name in enumerate(names))
    else:
        variances = np.repeat([found.angle_sigma_rad**2, found.position_sigma_m**2], 3)
        covariances = np.broadcast_to(np.diag(variances), covariances.shape)
    return Refinement(tuple(images), poses, covariances, gain, found, origin, observations, sigma, weak)


def gained(before: Block, after: Block, ties: Ties) -> Gain:
    """Compare two sets of poses on ties that neither was adjusted to."""
    squares = []
    for block in (before, after):
        left, _ = residuals(triangulated(block, ties), ties)
        squares.append(np.sum(left**2, axis=1) / (2 * ties.sigma**2))
    if not ties.points:
        return Gain(0.0, 0.0, 0.0, 0.0)
    # points on two rays only have a single redundant coordinate
    spare = (2.0 * ties.lengths / np.maximum(2 * ties.lengths - 3, 1))[ties.point]
    limit = CAPPED**2 * float(np.median(squares[0] * spare))
    first, second = (np.minimum(s * spare, limit) for s in squares)
    count = np.bincount(ties.image)
    seen = count > 0
    each = np.bincount(ties.image, first - second)[seen] / count[seen]
    score = float(np.mean(each) / max(np.std(each) / np.sqrt(len(each)), 1e-12)) if len(each) > 1 else 0.0
    was, now = float(np.mean(first)), float(np.mean(second))
    return Gain(float(np.sqrt(was)), float(np.sqrt(now)), float(np.sqrt(max(was - now, 0.0))), score)


def _in_pixels(found: Adjusted) -> FloatArray:
    """(N,) what the uncertainty of a pose moves its picture by: across the axis, at the depth of its ties, pixels."""
    block, ties = found.block, found.ties
    depth = residuals(block, ties)[1]
    result = np.full(len(block.centres), np.inf)
    for k in np.unique(ties.image).tolist():
        camera = block.cameras[block.camera[k]]
        d = float(np.median(depth[ties.image == k]))
        turn, move = np.zeros((2, 3)), block.rotations[k][:2] / d
        turn[0, 1], turn[1, 0] = 1.0, -1.0
        slope = np.concatenate([turn, -move], axis=1) * np.sqrt(camera.fx * camera.fy)
        result[k] = float(np.sqrt(np.trace(slope @ found.covariances[k] @ slope.T) / 2))
    return result
