"""Sixteen numbers at once are what sixteen single ones are."""

from __future__ import annotations

import numpy as np
from numba import njit

from cityflow.matching.lanes import (
    CENSUS_COLS,
    CENSUS_ROWS,
    LANES,
    census_bits,
    claim,
    least_of,
    path_step,
    unlike_bits,
)

RNG = np.random.default_rng(5)


@njit
def _census(image, stride, at, out, to):  # type: ignore[no-untyped-def]
    census_bits(image, stride, at, out, to)


@njit
def _unlike(own, census, at, cost, to):  # type: ignore[no-untyped-def]
    unlike_bits(own, census, at, cost, to)


@njit
def _path(buffers, cost, total, at, steps, first):  # type: ignore[no-untyped-def]
    least = path_step(buffers[0], buffers[1], cost, total, at, steps, first)
    return least, least_of(total, at[2])


@njit
def _claim(total, t, best, who, at, own):  # type: ignore[no-untyped-def]
    claim(total, t, best, who, at, np.int16(own))


def test_a_census_has_a_bit_for_each_darker_pixel_of_the_window() -> None:
    image = RNG.integers(0, 256, (9, 40)).astype(np.uint8)
    image[4, 10:14] = 255  # bright and dark as far as a byte goes
    image[4, 14:18] = 0
    row, col, out = 4, 7, np.full(LANES + 5, 77, np.uint64)
    _census(image.ravel(), 40, row * 40 + col, out, 3)
    offsets = [
        (i, j) for i in range(-CENSUS_ROWS, CENSUS_ROWS + 1) for j in range(-CENSUS_COLS, CENSUS_COLS + 1) if i or j
    ]
    assert len(offsets) <= 64
    for lane in range(LANES):
        centre = image[row, col + lane]
        true = sum(1 << bit for bit, (i, j) in enumerate(offsets) if image[row + i, col + lane + j] < centre)
        assert int(out[3 + lane]) == true
    assert out[:3].tolist() == [77] * 3
    assert out[3 + LANES :].tolist() == [77] * 2


def test_the_cost_is_the_number_of_bits_that_differ() -> None:
    census = RNG.integers(0, 1 << 63, 40).astype(np.uint64)
    own, cost = census[9], np.full(30, 200, np.uint8)
    _unlike(own, census, 5, cost, 2)
    assert cost[2 : 2 + LANES].tolist() == [bin(int(own) ^ int(c)).count("1") for c in census[5 : 5 + LANES]]
    assert cost[2 + 4] == 0
    assert cost[:2].tolist() == [200, 200]
    assert set(cost[2 + LANES :].tolist()) == {200}


def test_a_step_of_a_path_follows_its_formula() -> None:
    before = RNG.integers(100, 400, 60).astype(np.uint16)
    cost = RNG.integers(0, 62, 60).astype(np.uint8)
    b, a, t, (least, small, most) = 7, 4, 11, (100, 15, 180)
    was = RNG.integers(0, 500, 60).astype(np.uint16)
    true = []
    for k in range(LANES):
        low = min(before[b + k], before[b + k - 1] + small, before[b + k + 1] + small, most)
        true.append(int(cost[t + k]) + int(low) - least)
    for first in (True, False):
        after, total = np.zeros(60, np.uint16), was.copy()
        steps = np.uint16(least), np.uint16(small), np.uint16(most)
        found = _path((before, after), cost, total, (b, a, t), steps, first)
        assert after[a : a + LANES].tolist() == true
        summed = true if first else (was[t : t + LANES] + np.array(true)).tolist()
        assert total[t : t + LANES].tolist() == summed
        assert found == (min(true), min(summed))
        assert not after[:a].any()
        assert not after[a + LANES :].any()
        np.testing.assert_array_equal(np.delete(total, range(t, t + LANES)), np.delete(was, range(t, t + LANES)))


def test_a_place_goes_to_who_asks_least_and_stays_where_it_is_a_tie() -> None:
    total, best, who = np.full(40, 300, np.uint16), np.full(40, 200, np.uint16), np.full(40, -1, np.int16)
    total[5], total[6], total[8] = 199, 200, 0
    _claim(total, 5, best, who, 10, 42)
    taken = [10, 13]
    assert np.flatnonzero(who == 42).tolist() == taken
    assert best[taken].tolist() == [199, 0]
    assert set(np.delete(best, taken).tolist()) == {200}
    assert set(np.delete(who, taken).tolist()) == {-1}
