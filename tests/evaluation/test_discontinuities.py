"""Discontinuities against the truth: all found in the truth itself, missed where they are filled, invented where there are none."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.evaluation.discontinuities import (
    DiscontinuityAccuracy,
    SolidHull,
    compare_discontinuities,
    find_discontinuities,
)
from geometry_shapes import extrude, gable
from stacked_boxes import LEVELS, PLAIN, Boxes, arcade_and_set_back


def _against(model: Boxes, truth: Boxes | None = None) -> DiscontinuityAccuracy:
    return compare_discontinuities(truth or arcade_and_set_back(), model, LEVELS)


def test_the_truth_has_all_of_itself() -> None:
    accuracy = _against(arcade_and_set_back())
    assert [(j.true.level, j.true.under, j.found) for j in accuracy.judged] == [(0, True, True), (1, False, True)]
    assert [j.true.region.area for j in accuracy.judged] == pytest.approx([60, 40])
    assert [(j.depth_m, j.height_m) for j in accuracy.judged] == [pytest.approx((0, 0), abs=1e-9)] * 2
    assert accuracy.invented == ()


def test_a_filled_arcade_is_missed() -> None:
    accuracy = _against(arcade_and_set_back(arcade=0.0))
    assert [j.found for j in accuracy.judged] == [False, True]
    assert np.isnan(accuracy.judged[0].depth_m)
    assert accuracy.invented == ()


def test_a_block_misses_all_and_a_discontinuity_of_a_block_is_invented() -> None:
    assert [j.found for j in _against(PLAIN).judged] == [False, False]
    accuracy = _against(arcade_and_set_back(), PLAIN)
    assert accuracy.judged == ()
    assert [(d.level, d.under) for d in accuracy.invented] == [(0, True), (1, False)]


def test_errors_of_depths_and_heights_are_told() -> None:
    arcade, terrace = _against(arcade_and_set_back(2.8, 2.3, 3.4, 6.1)).judged
    assert (arcade.found, terrace.found) == (True, True)
    assert (arcade.depth_m, terrace.depth_m) == pytest.approx((-0.2, 0.3), abs=1e-6)
    assert (arcade.height_m, terrace.height_m) == pytest.approx((0.2, -0.3), abs=0.002)


def test_one_that_is_off_by_more_than_half_of_its_depth_is_missed() -> None:
    accuracy = _against(arcade_and_set_back(arcade=4.6, set_back=0.9))
    assert [j.found for j in accuracy.judged] == [False, False]


def test_one_at_another_place_is_missed_and_invented() -> None:
    other = Boxes((((0, 0, 20, 9), (0, 3.2)), ((0, 0, 20, 12), (3.2, 9.6))))
    accuracy = _against(other, Boxes((((0, 3, 20, 12), (0, 3.2)), ((0, 0, 20, 12), (3.2, 9.6)))))
    assert [j.found for j in accuracy.judged] == [False]
    assert len(accuracy.invented) == 1


def test_small_ones_do_not_count() -> None:
    shallow, short = arcade_and_set_back(0.9, 0.9), Boxes((((0, 0, 20, 12), (0, 9.6)), ((5, -1.5, 7.8, 0), (3.2, 9.6))))
    assert find_discontinuities(shallow, LEVELS) == []
    assert find_discontinuities(short, LEVELS) == []
    long = Boxes((((0, 0, 20, 12), (0, 9.6)), ((5, -1.5, 8.1, 0), (3.2, 9.6))))
    assert [d.under for d in find_discontinuities(long, LEVELS)] == [True]


def test_a_sloped_roof_is_none() -> None:
    house = SolidHull((gable(width=8, length=12, eave=3, ridge=6),))
    levels = np.array([[1.5, 1.5], [3.8, 0.8], [4.8, 0.5], [7.0, 0.5]])
    assert find_discontinuities(house, levels) == []


def test_solids_are_cut_as_boxes_are() -> None:
    solids = [
        extrude([[(p[0], p[1]), (p[2], p[1]), (p[2], p[3]), (p[0], p[3])]], *z) for p, z in arcade_and_set_back().parts
    ]
    accuracy = compare_discontinuities(arcade_and_set_back(), SolidHull(tuple(solids)), LEVELS)
    assert [j.found for j in accuracy.judged] == [True, True]
    assert [j.depth_m for j in accuracy.judged] == pytest.approx([0, 0], abs=1e-6)
    assert [j.height_m for j in accuracy.judged] == pytest.approx([0, 0], abs=0.002)
    nothing = compare_discontinuities(arcade_and_set_back(), SolidHull(()), LEVELS)
    assert [j.found for j in nothing.judged] == [False, False]


def test_a_storey_that_ends_a_little_higher_than_the_true_one_is_found() -> None:
    """The next level is close above: there the wall of the model has only begun."""
    levels = np.array([[4.0, 2.0], [8.4, 0.4]])
    true = Boxes((((0, 0, 20, 12), (0, 9.6)), ((5, -1.5, 9, 0), (2.0, 8.0))))
    model = Boxes((((0, 0, 20, 12), (0, 9.6)), ((5, -1.5, 9, 0), (2.0, 8.15))))
    (judged,) = compare_discontinuities(true, model, levels).judged
    assert judged.found
    assert judged.height_m == pytest.approx(0.15, abs=0.002)


def test_only_what_lies_within_the_area_counts() -> None:
    solids = tuple(
        extrude([[(p[0], p[1]), (p[2], p[1]), (p[2], p[3]), (p[0], p[3])]], *z) for p, z in arcade_and_set_back().parts
    )
    beside = SolidHull(solids, shapely.box(100, 100, 120, 120))
    assert find_discontinuities(beside, LEVELS) == []
