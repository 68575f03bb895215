from __future__ import annotations

import pytest
import shapely
from shapely import box

from cityflow.evaluation.outlines import blocks_of, compare_outlines, united_by_adjacency


def test_the_truth_itself_is_perfect() -> None:
    truth = [box(0, 0, 10, 10), box(20, 0, 30, 10)]
    a = compare_outlines(truth, truth)
    assert (a.completeness, a.correctness, a.completeness_area, a.correctness_area) == (1, 1, 1, 1)
    assert (a.iou, a.iou_weighted, a.boundary_m, a.corner_median_m) == (1, 1, 0, 0)


def test_figures_of_a_case_worked_out_by_hand() -> None:
    truth = [box(0, 0, 10, 10), box(20, 0, 30, 10), box(50, 0, 53, 3)]
    found = [box(0, 0, 10, 8), box(40, 0, 46, 10)]
    a = compare_outlines(found, truth)
    assert (a.true, a.found) == (2, 2)
    assert (a.completeness, a.correctness) == (0.5, 0.5)
    assert a.completeness_area == pytest.approx(80 / 209)
    assert a.correctness_area == pytest.approx(80 / 140)
    assert a.iou == pytest.approx(80 / 269)
    assert a.iou_weighted == pytest.approx(0.4)
    assert a.iou_each.tolist() == pytest.approx([0.8, 0.0])
    assert (a.missed, a.wrong) == ((1,), (1,))
    assert a.corner_mean_m == pytest.approx(1.0)


def test_two_found_halves_match_one_true_outline_and_half_covered_is_enough() -> None:
    a = compare_outlines([box(0, 0, 5, 10), box(5, 0, 10, 10)], [box(0, 0, 10, 10)])
    assert (a.completeness, a.correctness, a.iou_weighted) == (1, 1, 1)
    assert compare_outlines([box(0, 0, 5, 10)], [box(0, 0, 10, 10)]).completeness == 1
    assert compare_outlines([box(0, 0, 4.9, 10)], [box(0, 0, 10, 10)]).completeness == 0


def test_what_lies_outside_the_window_is_not_judged() -> None:
    a = compare_outlines([box(0, 0, 10, 10), box(100, 0, 120, 20)], [box(0, 0, 10, 10)], window=box(-5, -5, 15, 15))
    assert (a.correctness, a.correctness_area) == (1, 1)


def test_nothing_found_is_complete_failure_and_no_error() -> None:
    a = compare_outlines([], [box(0, 0, 10, 10)])
    assert (a.completeness, a.completeness_area, a.iou) == (0, 0, 0)
    assert a.missed == (0,)


def test_neighbours_are_united_over_small_gaps_only() -> None:
    row = [box(0, 0, 5, 10), box(5, 0, 10, 10), box(10.02, 0, 15, 10), box(15.5, 0, 20, 10)]
    united = united_by_adjacency(row)
    assert sorted(p.area for p in united) == pytest.approx([45, 150], abs=0.3)


def test_blocks_are_hulls_of_clusters() -> None:
    blocks = blocks_of([box(0, 0, 10, 10), box(12, 0, 20, 10), box(60, 0, 70, 10)], reach_m=5, margin_m=2)
    assert shapely.get_num_geometries(blocks) == 2
    assert blocks.contains(box(-1, -1, 21, 11))
    assert not blocks.intersects(shapely.Point(40, 5))


def test_joining_across_a_gap_costs_all_of_one_figure_and_the_gap_alone_in_the_other() -> None:
    truth = [box(0, 0, 10, 10), box(11, 0, 21, 10), box(40, 0, 50, 10)]
    a = compare_outlines([box(0, 0, 21, 10), box(40, 0, 50, 10)], truth)
    assert a.iou_each.tolist() == pytest.approx([100 / 210, 100 / 210, 1])
    assert a.iou_joined.tolist() == pytest.approx([200 / 210, 200 / 210, 1])
    assert a.iou_mean == pytest.approx((2 * 100 / 210 + 1) / 3)
    assert a.iou_joined_mean == pytest.approx((2 * 200 / 210 + 1) / 3)
    nothing = compare_outlines([], truth)
    assert nothing.iou_mean == nothing.iou_joined_mean == 0
