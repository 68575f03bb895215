from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from cityflow.outlines.from_heights.generalise import alternating_offsets, corners_of, without_short_edges
from cityflow.outlines.from_heights.rectangles import rectangle_approximation


def test_an_l_with_a_courtyard_is_its_own_approximation() -> None:
    region = np.ones((40, 60), bool)
    region[:15, 30:] = False
    region[22:30, 10:20] = False
    assert (rectangle_approximation(region, 4) == region).all()


def test_ragged_edges_become_straight_and_small_parts_are_not_followed() -> None:
    rng = np.random.default_rng(3)
    truth = np.zeros((60, 80), bool)
    truth[10:50, 10:70] = True
    ragged = truth.copy()
    ragged[9, 10:70] |= rng.random(60) < 0.1
    ragged[10, 10:70] &= rng.random(60) > 0.1
    ragged[9, 40] = True
    assert (rectangle_approximation(ragged, 61) ^ truth).sum() <= 60


def test_a_slanting_edge_ends_and_is_followed_to_the_quality_asked_for() -> None:
    rows, cols = np.mgrid[:80, :80]
    region = rows > cols
    off = [(rectangle_approximation(region, cells) ^ region).sum() / region.sum() for cells in (400, 40, 4)]
    assert off[0] > off[1] > off[2]
    assert off[2] < 0.1


def test_offsets_and_corners_are_each_others_inverse() -> None:
    ring = np.array([(0, 0), (6, 0), (6, 2), (4, 2), (4, 5), (0, 5)], float)
    for shift in range(6):
        offsets = alternating_offsets(np.roll(ring, shift, axis=0))
        assert Polygon(corners_of(offsets)).equals(Polygon(ring))


@pytest.mark.parametrize("shift", range(8))
def test_a_small_step_and_a_narrow_notch_go_with_the_smaller_change(shift: int) -> None:
    step = np.array([(0, 0), (10, 0), (10, 8), (3, 8), (3, 8.4), (0, 8.4)], float)
    notch = np.array([(0, 0), (4, 0), (4, 3), (4.5, 3), (4.5, 0), (10, 0), (10, 8), (0, 8)], float)
    straight = Polygon(corners_of(without_short_edges(alternating_offsets(np.roll(step, shift, axis=0)), 1.0)))
    filled = Polygon(corners_of(without_short_edges(alternating_offsets(np.roll(notch, shift, axis=0)), 1.0)))
    assert straight.area == pytest.approx(80)
    assert filled.area == pytest.approx(80)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-20, 20), min_size=8, max_size=24).filter(lambda v: len(v) % 2 == 0), st.floats(0.5, 5))
def test_no_short_edge_is_left(offsets: list[float], shortest: float) -> None:
    result = without_short_edges(np.array(offsets), shortest)
    length = np.abs(np.roll(result, -1) - np.roll(result, 1))
    assert len(result) == 4 or length.min() >= shortest
    assert len(result) % 2 == 0
