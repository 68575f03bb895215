"""Sums over paths and the way back, against the definition computed pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import ByteArray, IntArray
from cityflow.matching.census import census
from cityflow.matching.disparity_search import Search, Sight
from cityflow.matching.paths import BACK_PX, EDGE_GREY, LEAST_MORE, Penalties, best_shifts

ROWS, COLS = 14, 26
P = Penalties(9, 40)
FOUR = [(1, 0), (-1, 0), (0, 1), (0, -1)]
EIGHT = [*FOUR, (1, 1), (1, -1), (-1, 1), (-1, -1)]
Costs = dict[int, int]


def scene(seed: int) -> tuple[ByteArray, ByteArray, Search, Sight]:
    """Images that are alike in part, and ranges of one to three chunks that begin anywhere; some pixels search nothing."""
    rng = np.random.default_rng(seed)
    low = rng.integers(-20, 10, (ROWS, COLS)).astype(np.int32)
    high = low + rng.integers(0, 30, (ROWS, COLS)).astype(np.int32)
    search = Search(low, high)
    first, end = search.hull() or (0, 0)
    partner = rng.integers(0, 255, (ROWS, COLS + end - first - 1)).astype(np.uint8)
    reference = np.ascontiguousarray(partner[:, end - 4 : end - 4 + COLS])
    reference[:, 12:] = rng.integers(0, 255, (ROWS, COLS - 12))
    return reference, partner, search, Sight(rng.random((ROWS, COLS)) > 0.05, np.ones(partner.shape, bool), 1 - end)


def summed(
    costs: dict[tuple[int, int], Costs], grey: IntArray, ways: list[tuple[int, int]]
) -> dict[tuple[int, int], Costs]:
    """Hirschmüller 2008, equation 13, over shifts of single pixels."""
    total: dict[tuple[int, int], Costs] = {at: dict.fromkeys(own, 0) for at, own in costs.items()}
    for down, right in ways:
        path: dict[tuple[int, int], Costs] = {}
        for at in sorted(costs, key=lambda at: (at[0] * down, at[1] * right)):
            came = at[0] - down, at[1] - right
            before = path.get(came)
            path[at] = dict(costs[at])
            if before:
                least = min(before.values())
                unlike = abs(int(grey[at]) - int(grey[came]))
                large = round(max(P.large / (1 + unlike / EDGE_GREY), P.small + LEAST_MORE))
                for shift in costs[at]:
                    # a chunk that the pixel before did not search is entered by a large step only
                    steps = [least + large]
                    if shift in before:
                        steps += [before[shift], *(before[s] + P.small for s in (shift - 1, shift + 1) if s in before)]
                    path[at][shift] += min(steps) - least
            for shift, cost in path[at].items():
                total[at][shift] += cost
    return total


@pytest.mark.parametrize("eight", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_shifts_are_those_of_the_definition(seed: int, eight: bool) -> None:
    reference, partner, search, sight = scene(seed)
    chunks = search.chunks(sight)
    bits = census(reference), census(partner)
    costs: dict[tuple[int, int], Costs] = {}
    for at in np.ndindex(ROWS, COLS):
        if chunks.many[at]:
            begin = 16 * int(chunks.first[at])
            costs[at] = {
                s: (int(bits[0][at]) ^ int(bits[1][at[0], at[1] + s - sight.first])).bit_count()
                for s in range(begin, begin + 16 * int(chunks.many[at]))
            }
    total = summed(costs, reference.astype(np.int64), EIGHT if eight else FOUR)
    holder: dict[tuple[int, int], tuple[int, int]] = {}
    for (row, col), own in total.items():
        for shift, cost in own.items():
            if cost < holder.get((row, col + shift), (1 << 30, 0))[0]:
                holder[row, col + shift] = cost, col
    found = best_shifts(*bits, sight.first, chunks, reference, P, eight=eight)
    kept = 0
    for at in np.ndindex(ROWS, COLS):
        if at not in total:
            assert np.isnan(found[at])
            continue
        best = min(total[at], key=lambda s: (total[at][s], s))
        if abs(holder[at[0], at[1] + best][1] - at[1]) > BACK_PX:
            assert np.isnan(found[at])
        else:
            kept += 1
            assert abs(float(found[at]) - best) <= 0.5
    assert kept > 0.3 * ROWS * COLS


def test_the_part_of_a_pixel_is_that_of_a_parabola() -> None:
    """One row and no neighbours: sums are four times the costs."""
    reference, partner, search, sight = scene(3)
    chunks = Search(search.low[:1, :1], search.high[:1, :1]).chunks(
        Sight(np.ones((1, 1), bool), sight.partner[:1], sight.first)
    )
    bits = census(reference[:1, :1]), census(partner[:1])
    begin, many = 16 * int(chunks.first[0, 0]), 16 * int(chunks.many[0, 0])
    cost = [(int(bits[0][0, 0]) ^ int(bits[1][0, s - sight.first])).bit_count() for s in range(begin, begin + many)]
    n = int(np.argmin(cost))
    assert 0 < n < many - 1
    below, above = cost[n - 1] - cost[n], cost[n + 1] - cost[n]
    found = best_shifts(*bits, sight.first, chunks, reference[:1, :1], P, eight=False)
    assert found[0, 0] == pytest.approx(begin + n + 0.5 * (below - above) / (below + above), abs=1e-5)
