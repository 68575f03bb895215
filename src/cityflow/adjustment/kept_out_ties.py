"""What an adjustment does to tie points that it did not know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.adjustment.block import Block, residuals
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import triangulated

LEAST_GAIN_PX = 0.1
"""Poses that are off by less are left as they are; set by hand, as are those below."""
SURE = 2.0
"""Standard deviations by which the gain must differ from nothing."""
CAPPED = 4.0
"""Residuals count up to this multiple of their usual size, so that mismatches do not judge."""


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
