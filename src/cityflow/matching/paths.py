"""Semi-global matching over a range of shifts of its own for each pixel (Hirschmüller 2008, Rothermel et al. 2012).

A shift is the partner's column less the reference's: a disparity with the other sign. The shifts that a pixel searches are whole chunks of 16 on a
common scale, so that neighbours' costs line up and a step of a path is a few instructions on 16 numbers. Costs of all pixels lie one after the other.
Costs come from four paths (along rows and columns) or eight; the way back is read from the same sums: each pixel of the partner belongs to the
reference's pixel that claims it at the least cost.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray, Float32Array, IntArray
from cityflow.core.kernels import njit
from cityflow.matching.census import Census
from cityflow.matching.lanes import LANES, claim, least_of, path_step, unlike_bits

EDGE_GREY = 12.0
"""Difference of neighbours' grey values at which a large step costs half: surfaces end at edges of the image (Hirschmüller 2008). Set by hand on
images of the synthetic town, as is the next one."""
LEAST_MORE = 10
"""What a large step costs more than a small one at least."""
BACK_PX = 2
"""The way back from the partner's pixel ends no farther from where it began: a wall may be two or three times as wide in one image as in the other, and
then as many of its pixels share one of the partner's. Set by hand on images of the synthetic town: with one pixel, a tenth of such walls is lost."""
FAR = 60_000
"""Cost of a shift that a pixel does not search; more than any sum of a path."""


class Chunks(NamedTuple):
    """What each pixel searches.

    Attributes
    ----------
    first : (rows, cols) int32, first chunk: shifts from 16 · first
    many : (rows, cols) int32, number of chunks; 0 where nothing is searched
    start : (rows · cols + 1,) int64, number of chunks of all pixels before
    """

    first: NDArray[np.int32]
    many: NDArray[np.int32]
    start: IntArray


class Sums(NamedTuple):
    """Costs of all shifts of all pixels: uint8 of the census, uint16 summed over paths."""

    cost: NDArray[np.uint8]
    total: NDArray[np.uint16]


class Steps(NamedTuple):
    """Penalty of a step of one pixel; of a larger one by the difference of grey values of the two pixels, (256,); the grey values, (rows, cols)."""

    small: np.uint16
    large: NDArray[np.uint16]
    grey: ByteArray


class Penalties(NamedTuple):
    """Of a step of one pixel, and of any larger one between pixels of the same grey; both less than 1,000."""

    small: int
    large: int


def best_shifts(
    reference: Census, partner: Census, low: int, chunks: Chunks, grey: ByteArray, penalties: Penalties, *, eight: bool
) -> Float32Array:
    """(rows, cols) float32 shifts that both sides agree on within `BACK_PX`, by a parabola between whole pixels; NaN elsewhere.

    Parameters
    ----------
    reference, partner : census of either image; the partner's column of pixel x and shift s is x + s - low
    grey : (rows, cols) uint8 of the reference image
    eight : paths are eight, not four
    """
    cost = _costs(reference, partner, low, chunks)
    sums = Sums(cost, np.empty(cost.size, np.uint16))
    large = np.maximum(penalties.large / (1 + np.arange(256) / EDGE_GREY), penalties.small + LEAST_MORE)
    steps = Steps(np.uint16(penalties.small), np.rint(large).astype(np.uint16), grey)
    _downward(sums, chunks, steps, eight)
    return np.asarray(_upward(sums, chunks, steps, eight, low, partner.shape[1]))


@njit(cache=True, nogil=True)
def _costs(reference, partner, low, chunks):  # type: ignore[no-untyped-def]
    first, count, start = chunks
    rows, cols = first.shape
    cost = np.empty((start[-1] + 1) * LANES, np.uint8)
    for i in range(rows):
        row = partner[i]
        for j in range(cols):
            own, at, to = reference[i, j], j + first[i, j] * LANES - low, start[i * cols + j] * LANES
            for c in range(count[i, j]):
                unlike_bits(own, row, at + LANES * c, cost, to + LANES * c)
    return cost


@njit(nogil=True, inline="always")
def _step(before, after, cost, total, came, own, penalties, sets):  # type: ignore[no-untyped-def]
    """One path comes to a pixel; its least cost.

    `came` from: place in `before`, first chunk, their number, least cost. `own`: place in `after`, place in the sums, first chunk, their number.
    """
    b, first_b, count_b, least_b = came
    a, t, first, count = own
    least_before = np.uint16(least_b if count_b else 0)
    most = np.uint16(least_before + penalties[1]) if count_b else np.uint16(0)
    steps = least_before, penalties[0], most
    least = np.uint16(65535)
    for c in range(count):
        q = first + c - first_b
        # the end of the buffer holds nothing but FAR
        place = b + LANES * q if 0 <= q < count_b else before.size - LANES - 1
        found = path_step(before, after, cost, total, (place, a + LANES * c, t + LANES * c), steps, sets)
        least = min(least, found)
    after[a - 1] = FAR
    after[a + LANES * count] = FAR
    return np.int64(least)


@njit(nogil=True, inline="always")
def _column_steps(at, sums, chunks, buffers, penalties, eight, sets):  # type: ignore[no-untyped-def]
    """Paths that come to a pixel from the row `back`: straight, and with `eight` from both sides."""
    i, j, back = at
    cost, total = sums
    first, count, start = chunks
    lines, leasts = buffers
    rows, cols = first.shape
    row, now, old = i + back, i & 1, 1 - (i & 1)
    t = start[i * cols + j] * LANES
    own = (t - start[i * cols] * LANES + 2 * j + 1, t, np.int64(first[i, j]), np.int64(count[i, j]))
    for way in range(3 if eight else 1):
        col = j + (way if way < 2 else -1)
        came: Any = (1, 0, 0, 0)
        unlike: Any = 0
        if 0 <= row < rows and 0 <= col < cols:
            unlike = abs(np.int64(penalties.grey[i, j]) - np.int64(penalties.grey[row, col]))
            b = (start[row * cols + col] - start[row * cols]) * LANES + 2 * col + 1
            came = (b, np.int64(first[row, col]), np.int64(count[row, col]), leasts[way, old, col])
        leasts[way, now, j] = _step(
            lines[way, old],
            lines[way, now],
            cost,
            total,
            came,
            own,
            (penalties.small, penalties.large[unlike]),
            sets and way == 0,
        )


@njit(nogil=True, inline="always")
def _buffers(chunks, eight):  # type: ignore[no-untyped-def]
    """Costs of two rows for each way, and their least."""
    _, count, start = chunks
    rows, cols = count.shape
    widest = 0
    for i in range(rows):
        widest = max(widest, start[(i + 1) * cols] - start[i * cols])
    ways = 3 if eight else 1
    lines = np.full((ways, 2, widest * LANES + 2 * cols + 3 * LANES), FAR, np.uint16)
    return lines, np.zeros((ways, 2, cols), np.int64)


@njit(cache=True, nogil=True)
def _downward(sums, chunks, penalties, eight):  # type: ignore[no-untyped-def]
    """Paths from above and both along the rows."""
    cost, total = sums
    first, count, start = chunks
    rows, cols = first.shape
    buffers = _buffers(chunks, eight)
    side = np.full((2, (count.max() + 4) * LANES), FAR, np.uint16)
    for i in range(rows):
        for j in range(cols):
            if count[i, j]:
                _column_steps((i, j, -1), sums, chunks, buffers, penalties, eight, True)
        for way in (1, -1):
            came: Any = (1, 0, 0, 0)
            for k in range(cols):
                j = k if way == 1 else cols - 1 - k
                f, n, least = np.int64(first[i, j]), np.int64(count[i, j]), 0
                if n:
                    own = (1, start[i * cols + j] * LANES, f, n)
                    unlike = abs(
                        np.int64(penalties.grey[i, j]) - np.int64(penalties.grey[i, min(max(j - way, 0), cols - 1)])
                    )
                    steps = (penalties.small, penalties.large[unlike])
                    least = _step(side[1 - (j & 1)], side[j & 1], cost, total, came, own, steps, False)
                came = (1, f, n, least)


@njit(cache=True, nogil=True)
def _upward(sums, chunks, penalties, eight, low, wide):  # type: ignore[no-untyped-def]
    """Paths from below; then the sums are complete, and the row's shifts are chosen."""
    total = sums[1]
    first, count, start = chunks
    rows, cols = first.shape
    buffers = _buffers(chunks, eight)
    out = np.full((rows, cols), np.nan, np.float32)
    best, who = np.empty(wide + LANES, np.uint16), np.empty(wide + LANES, np.int16)
    won = np.empty(cols, np.int32)
    for k in range(rows):
        i = rows - 1 - k
        best[:] = 65535
        who[:] = -1
        for j in range(cols):
            won[j] = -1
            if count[i, j] == 0:
                continue
            _column_steps((i, j, 1), sums, chunks, buffers, penalties, eight, False)
            t, at = start[i * cols + j] * LANES, j + first[i, j] * LANES - low
            least = np.uint16(65535)
            for c in range(count[i, j]):
                least = min(least, least_of(total, t + LANES * c))
                claim(total, t + LANES * c, best, who, at + LANES * c, np.int16(j))
            n = 0
            while total[t + n] != least:
                n += 1
            won[j] = n
        for j in range(cols):
            n = won[j]
            if n < 0 or abs(who[j + first[i, j] * LANES - low + n] - j) > BACK_PX:
                continue
            t = start[i * cols + j] * LANES
            shift = np.float32(first[i, j] * LANES + n)
            if 0 < n < count[i, j] * LANES - 1:
                own = np.int32(total[t + n])
                below, above = np.int32(total[t + n - 1]) - own, np.int32(total[t + n + 1]) - own
                if below + above > 0:
                    shift += np.float32(0.5) * np.float32(below - above) / np.float32(below + above)
            out[i, j] = shift
    return out
