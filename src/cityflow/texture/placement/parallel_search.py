"""Parallel search for a patch's position: each thread searches its own blocks of scanlines and stops when others are ahead.

Frommholz et al. 2017, section 5: patches depend on their predecessors, so only the search for a single patch can be shared.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.texture.placement.availability import Availability, nothing_taken, occupy, with_rows
from cityflow.texture.placement.layout import COL, NOWHERE, ROW, TURN, Bounds, first_spot, reach_of, runs_of
from cityflow.texture.placement.pixel_runs import TURNS, Patches

BLOCK_ROWS = 32
"""Of a page that are searched at a time; no result depends on it."""


def filled_by_threads(patches: Patches, order: IntArray, bounds: Bounds, threads: int) -> IntArray:
    """What `layout.filled` gives, bit for bit."""
    spots = np.full((len(patches.pixels), 3), NOWHERE, np.int64)
    page = nothing_taken(min(bounds.first_rows, bounds.last_rows), bounds.width)
    with ThreadPoolExecutor(threads) as pool:
        for patch in order.tolist():
            spot = _shared_search(pool, threads, patches, patch, page)
            while spot[TURN] < 0 and len(page.free) < bounds.last_rows:
                page = with_rows(page, min(2 * len(page.free), bounds.last_rows))
                spot = _shared_search(pool, threads, patches, patch, page)
            if spot[TURN] >= 0:
                spots[patch] = spot
                occupy(page, runs_of(patches, TURNS * patch + int(spot[TURN])), spot[ROW], spot[COL])
    return spots


def _shared_search(
    pool: ThreadPoolExecutor, threads: int, patches: Patches, patch: int, page: Availability
) -> IntArray:
    lowest = np.full(threads, np.inf)
    others = [pool.submit(_in_own_blocks, patches, patch, page, lowest, number) for number in range(1, threads)]
    found = [_in_own_blocks(patches, patch, page, lowest, 0), *(other.result() for other in others)]
    # as in a search by one thread, a later turn wins only where it is truly lower
    return found[min(range(threads), key=lambda number: (lowest[number], found[number][TURN]))]


@njit(cache=True, nogil=True)
def _in_own_blocks(patches: Patches, patch: int, page: Availability, lowest: FloatArray, number: int) -> IntArray:
    """The lowest spot in every len(lowest)-th block of rows; how low it is goes to `lowest`, where all others see it."""
    spot = np.full(3, NOWHERE, np.int64)
    for turn in range(TURNS):
        turned = TURNS * patch + turn
        reach, end = reach_of(patches, turned), len(page.free) - patches.shapes[turned, 0] + 1
        for first in range(number * BLOCK_ROWS, end if patches.distinct[turned] else 0, len(lowest) * BLOCK_ROWS):
            if first + reach > lowest.min():
                break
            row, col = first_spot(patches, turned, page, first, min(first + BLOCK_ROWS, end))
            if row >= 0:
                if row + reach < lowest[number]:
                    lowest[number] = row + reach
                    spot[ROW], spot[COL], spot[TURN] = row, col, turn
                break
    return spot
