"""Which disparities each pixel searches: those of the coarser level around it (Rothermel et al. 2012, tSGM)."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.matching.lanes import LANES
from cityflow.matching.paths import Chunks

NEAR_PX = (2, 6, 20)
"""Pixels of the coarser level around one whose disparities are searched; where all of them are unknown, the next larger distance counts.
A pixel that is unknown itself begins with the second. Set by hand on images of the synthetic town, as is the next one."""
MARGIN_PX = 3
"""What a pixel searches beyond the disparities around it, pixels of its own level."""
NOTHING = 1e9

Range = tuple[int, int]
"""Half-open range of disparities, pixels of the level."""


class Search(NamedTuple):
    """Lowest and highest disparity that each pixel of a raster window searches, (rows, cols) int32; nothing where the lowest is higher."""

    low: NDArray[np.int32]
    high: NDArray[np.int32]

    def chunks(self, seen: BoolArray | None) -> Chunks:
        """The chunks of 16 shifts that hold the disparities of the pixels that are `seen` (None: all)."""
        first, last = -self.high >> 4, -self.low >> 4
        count = np.maximum(last - first + 1, 0).astype(np.int32)
        if seen is not None:
            count[~seen] = 0
        return Chunks.of(np.ascontiguousarray(first), count)

    def hull(self) -> Range | None:
        """All disparities of all chunks; None where no pixel searches any."""
        some = self.low <= self.high
        if not some.any():
            return None
        low, high = int(self.low.min(where=some, initial=1 << 30)), int(self.high.max(where=some, initial=-(1 << 30)))
        return -((-low >> 4) * LANES + LANES - 1), -(-high >> 4) * LANES + 1

    def doubled(self, at: tuple[int, int], corner: tuple[int, int], shape: tuple[int, int]) -> Search:
        """The same for the pixels of a raster window of the finer level; `at`, `corner`: row and column of the first pixel in either lattice."""
        top, left = corner[0] - 2 * at[0], corner[1] - 2 * at[1]
        window = np.s_[top : top + shape[0], left : left + shape[1]]
        low, high = (np.ascontiguousarray(np.repeat(np.repeat(part, 2, axis=0), 2, axis=1)[window]) for part in self)
        return Search(low, high)


def search_everywhere(shape: tuple[int, int], widest: Range) -> Search:
    """The same for all pixels."""
    return Search(np.full(shape, widest[0], np.int32), np.full(shape, widest[1] - 1, np.int32))


def search_around(guide: Float32Array, widest: Range, most: int) -> Search:
    """What the pixels of a level search by the coarser one; of the size of the guide.

    Parameters
    ----------
    guide : (h, w) float32 disparities of the coarser level, its pixels; NaN where unknown
    widest : disparities that heights allow, which is all that is searched where nothing is known around
    most : bound of a pixel's range
    """
    lowest, highest = _around(guide)
    known = lowest < NOTHING
    low = np.where(known, np.floor(2 * lowest) - MARGIN_PX, widest[0]).astype(np.int32)
    high = np.where(known, np.ceil(2 * highest) + MARGIN_PX, widest[1] - 1).astype(np.int32)
    low, high = np.maximum(low, widest[0]), np.minimum(high, widest[1] - 1)
    return Search(low, np.minimum(high, low + most - 1))


def _around(guide: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Lowest and highest known disparity around each pixel; NOTHING where all are unknown."""
    known = np.isfinite(guide)
    lowest, highest = np.where(known, guide, np.float32(NOTHING)), np.where(known, guide, np.float32(-NOTHING))
    low, high = np.full_like(guide, NOTHING), np.full_like(guide, -NOTHING)
    open_, first = np.ones_like(known), True
    for reach in NEAR_PX:
        size = 2 * reach + 1
        box = cv2.getStructuringElement(cv2.MORPH_RECT, (size, size))
        near, far = cv2.erode(lowest, box), cv2.dilate(highest, box)
        use = open_ & (near < NOTHING) & (known if first else True)
        low[use], high[use] = near[use], far[use]
        open_, first = open_ & ~use, False
    if known.any():
        # nothing within reach: what the whole guide knows
        low[open_], high[open_] = guide[known].min(), guide[known].max()
    return low, high
