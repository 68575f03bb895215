"""Which disparities each pixel searches: those of the coarser level around it (Rothermel et al. 2012, tSGM)."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.core.kernels import njit
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
    """Lowest and highest disparity that each pixel of a raster window searches.

    Attributes
    ----------
    low, high : (h, w) int32; nothing is searched where the lowest is higher
    corner, bits : pixel (row, col) of the window searches what stands at ((row + corner[0]) >> bits, (col + corner[1]) >> bits)
    """

    low: NDArray[np.int32]
    high: NDArray[np.int32]
    corner: tuple[int, int] = (0, 0)
    bits: int = 0

    def hull(self) -> Range | None:
        """All disparities of all chunks; None where no pixel searches any."""
        some = self.low <= self.high
        if not some.any():
            return None
        low, high = int(self.low.min(where=some, initial=1 << 30)), int(self.high.max(where=some, initial=-(1 << 30)))
        return -((-low >> 4) * LANES + LANES - 1), -(-high >> 4) * LANES + 1

    def chunks(self, sight: Sight) -> Chunks:
        """The chunks of 16 shifts that hold the disparities of the pixels that both images show."""
        return Chunks(*_chunks(self, sight))

    def inside(self, shifts: Float32Array, sight: Sight) -> Float32Array:
        """Disparities: the shifts with the other sign, less those that a pixel did not search or that the partner does not show.

        What a chunk holds beyond a pixel's own range helps its paths only; found there, it is more often wrong than right.
        """
        return np.asarray(_inside(self, shifts, sight))


class Sight(NamedTuple):
    """Pixels that the images show.

    Attributes
    ----------
    reference : (rows, cols) bool;  partner : (rows, more) bool
    first : disparity d of pixel x is at the partner's column x - d - first
    """

    reference: BoolArray
    partner: BoolArray
    first: int


def search_everywhere(widest: Range) -> Search:
    """The same for all pixels."""
    return Search(np.full((1, 1), widest[0], np.int32), np.full((1, 1), widest[1] - 1, np.int32), bits=30)


@njit(cache=True, nogil=True)
def _chunks(search, sight):  # type: ignore[no-untyped-def]
    """Of a `Search` and a `Sight`: first chunk, number of chunks, chunks of all pixels before."""
    rows, cols = sight.reference.shape
    wide = sight.partner.shape[1]
    first, many = np.zeros((rows, cols), np.int32), np.zeros((rows, cols), np.int32)
    start = np.empty(rows * cols + 1, np.int64)
    before = np.empty(wide + 1, np.int32)
    total = 0
    for i in range(rows):
        before[0] = 0
        for j in range(wide):
            before[j + 1] = before[j] + sight.partner[i, j]
        r = (i + search.corner[0]) >> search.bits
        for j in range(cols):
            start[i * cols + j] = total
            c = (j + search.corner[1]) >> search.bits
            low, high = search.low[r, c], search.high[r, c]
            begin, end = j - high - sight.first, j - low + 1 - sight.first
            begin, end = min(max(begin, 0), wide), min(max(end, 0), wide)
            if sight.reference[i, j] and low <= high and before[end] > before[begin]:
                first[i, j] = -high >> 4
                many[i, j] = (-low >> 4) - first[i, j] + 1
                total += many[i, j]
    start[rows * cols] = total
    return first, many, start


@njit(cache=True, nogil=True)
def _inside(search, shifts, sight):  # type: ignore[no-untyped-def]
    rows, cols = shifts.shape
    wide = sight.partner.shape[1]
    half = np.float32(0.5)
    out = np.full((rows, cols), np.nan, np.float32)
    for i in range(rows):
        r = (i + search.corner[0]) >> search.bits
        for j in range(cols):
            disparity = -shifts[i, j]
            c = (j + search.corner[1]) >> search.bits
            # False with NaN
            if search.low[r, c] - half <= disparity <= search.high[r, c] + half:
                at = j - int(np.rint(disparity)) - sight.first
                if 0 <= at < wide and sight.partner[i, at]:
                    out[i, j] = disparity
    return out


def hull_around(guide: Float32Array, widest: Range) -> Range | None:
    """That of `search_around`, sooner: whatever a pixel searches lies between the lowest and the highest that the guide knows."""
    known = guide[np.isfinite(guide)]
    low, high = widest[0], widest[1] - 1
    if len(known):
        low = max(int(np.floor(2 * known.min())) - MARGIN_PX, low)
        high = min(int(np.ceil(2 * known.max())) + MARGIN_PX, high)
    return Search(np.array([low], np.int32), np.array([high], np.int32)).hull()


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
