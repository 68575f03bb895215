"""Semi-global matching over a range of shifts of its own for each pixel (Hirschmüller 2008, Rothermel et al. 2012).

A shift is the partner's column less the reference's: a disparity with the other sign. The shifts that a pixel searches are whole chunks of 16 on a
common scale, so that neighbours' costs line up and a step of a path is a few instructions on 16 numbers. Costs of all pixels lie one after the other.
Costs come from four paths (along rows and columns) or eight; the way back is read from the same sums: each pixel of the partner belongs to the
reference's pixel that claims it at the least cost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import Float32Array, IntArray
from cityflow.core.kernels import njit
from cityflow.matching.census import Census
from cityflow.matching.lanes import LANES, claim, least_of, path_step, unlike_bits

FAR = 60_000
"""Cost of a shift that a pixel does not search; more than any sum of a path."""


class Chunks(NamedTuple):
    """What each pixel searches.

    Attributes
    ----------
    first : (rows, cols) int32, first chunk: shifts from 16 · first
    count : (rows, cols) int32, number of chunks; 0 where nothing is searched
    start : (rows · cols + 1,) int64, number of chunks of all pixels before
    """

    first: IntArray
    count: IntArray
    start: IntArray

    @classmethod
    def of(cls, first: IntArray, count: IntArray) -> Chunks:
        return cls(first, count, np.concatenate([[0], np.cumsum(count, dtype=np.int64)]))


def best_shifts(
    reference: Census, partner: Census, low: int, chunks: Chunks, penalties: tuple[int, int], *, eight: bool
) -> Float32Array:
    """(rows, cols) float32 shifts that both sides agree on within a pixel, by a parabola between whole pixels; NaN elsewhere.

    Parameters
    ----------
    reference, partner : uint64 census; the partner's column of pixel x and shift s is x + s - low
    penalties : of a step of one pixel, and of any larger one; both less than 150
    """
    small, large = np.uint16(penalties[0]), np.uint16(penalties[1])
    cost = _costs(reference, partner, low, *chunks)
    total = np.empty(cost.size, np.uint16)
    _downward(cost, total, *chunks, small, large, eight)
    return np.asarray(_upward(cost, total, *chunks, small, large, eight, low, partner.shape[1]))


@njit(cache=True, nogil=True)
def _costs(reference, partner, low, first, count, start):  # type: ignore[no-untyped-def]
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
def _step(before, b, first_b, count_b, least_b, small, large, cost, total, t, first, count, after, a, sets):  # type: ignore[no-untyped-def]
    """One path comes to a pixel; its least cost."""
    least = np.uint16(65535)
    if count_b == 0:
        least_b, most = np.uint16(0), np.uint16(0)
    else:
        most = np.uint16(least_b + large)
    for c in range(count):
        q = first + c - first_b
        # the end of the buffer holds nothing but FAR
        place = b + LANES * q if 0 <= q < count_b else before.size - LANES - 1
        found = path_step(
            before, place, least_b, small, most, cost, t + LANES * c, after, a + LANES * c, total, t + LANES * c, sets
        )
        least = min(least, found)
    after[a - 1] = FAR
    after[a + LANES * count] = FAR
    return np.uint16(least)


@njit(nogil=True, inline="always")
def _column_steps(i, j, back, lines, leasts, small, large, cost, total, first, count, start, eight, sets):  # type: ignore[no-untyped-def]
    """Paths from row i + back: straight, and in `eight` from both sides."""
    rows, cols = first.shape
    own, row = start[i * cols], i + back
    t, n, f = start[i * cols + j] * LANES, count[i, j], first[i, j]
    a = (start[i * cols + j] - own) * LANES + 2 * j + 1
    for way in range(3 if eight else 1):
        col = j + (way if way < 2 else -1)
        after = lines[way, i & 1]
        before = lines[way, 1 - (i & 1)]
        if 0 <= row < rows and 0 <= col < cols:
            b = (start[row * cols + col] - start[row * cols]) * LANES + 2 * col + 1
            leasts[way, i & 1, j] = _step(
                before, b, first[row, col], count[row, col], leasts[way, 1 - (i & 1), col], small, large,
                cost, total, t, f, n, after, a, sets and way == 0,
            )  # fmt: skip
        else:
            leasts[way, i & 1, j] = _step(
                before, 1, 0, 0, np.uint16(0), small, large, cost, total, t, f, n, after, a, sets and way == 0
            )


@njit(nogil=True, inline="always")
def _buffers(count, start, eight):  # type: ignore[no-untyped-def]
    """Costs of two rows for each way, and their least."""
    rows, cols = count.shape
    widest = 0
    for i in range(rows):
        widest = max(widest, start[(i + 1) * cols] - start[i * cols])
    ways = 3 if eight else 1
    return np.full((ways, 2, widest * LANES + 2 * cols + 3 * LANES), FAR, np.uint16), np.zeros(
        (ways, 2, cols), np.uint16
    )


@njit(cache=True, nogil=True)
def _downward(cost, total, first, count, start, small, large, eight):  # type: ignore[no-untyped-def]
    """Paths from above and both along the rows."""
    rows, cols = first.shape
    lines, leasts = _buffers(count, start, eight)
    side = np.full((2, (count.max() + 4) * LANES), FAR, np.uint16)
    for i in range(rows):
        for j in range(cols):
            if count[i, j]:
                _column_steps(i, j, -1, lines, leasts, small, large, cost, total, first, count, start, eight, True)
        for way in (1, -1):
            least, first_b, count_b = np.uint16(0), 0, 0
            for k in range(cols):
                j = k if way == 1 else cols - 1 - k
                f, n, t = first[i, j], count[i, j], start[i * cols + j] * LANES
                if n:
                    least = _step(
                        side[1 - (j & 1)],
                        1,
                        first_b,
                        count_b,
                        least,
                        small,
                        large,
                        cost,
                        total,
                        t,
                        f,
                        n,
                        side[j & 1],
                        1,
                        False,
                    )
                first_b, count_b = f, n


@njit(cache=True, nogil=True)
def _upward(cost, total, first, count, start, small, large, eight, low, wide):  # type: ignore[no-untyped-def]
    """Paths from below; then the sums are complete, and the row's shifts are chosen."""
    rows, cols = first.shape
    lines, leasts = _buffers(count, start, eight)
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
            _column_steps(i, j, 1, lines, leasts, small, large, cost, total, first, count, start, eight, False)
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
            if n < 0 or abs(who[j + first[i, j] * LANES - low + n] - j) > 1:
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
