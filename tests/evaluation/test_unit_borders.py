from __future__ import annotations

import pytest
import shapely
from shapely import LineString, Polygon, box

from cityflow.evaluation.unit_borders import angle_between, borders_of, main_direction, with_traces


def test_units_that_touch_have_one_border_along_all_they_share() -> None:
    (border,) = borders_of([box(0, 0, 5, 10), box(5, 2, 10, 12)])
    assert border.units == (0, 1)
    assert border.gap_m == 0
    assert border.traces is None
    assert border.line.equals(LineString([(5, 2), (5, 10)]))


def test_a_corner_is_no_border_and_far_units_have_none() -> None:
    assert borders_of([box(0, 0, 5, 10), box(5, 9.5, 10, 20)]) == []
    assert borders_of([box(0, 0, 5, 10), box(8, 0, 12, 10)]) == []
    assert borders_of([box(0, 0, 5, 10)]) == []
    assert borders_of([]) == []


def test_a_gap_has_two_borders_along_what_faces_each_other() -> None:
    first, second = borders_of([box(0, 0, 5, 10), box(6, 3, 11, 13)])
    assert (first.units, second.units) == ((0, 1), (1, 0))
    assert first.gap_m == second.gap_m == pytest.approx(1.0)
    assert first.line.equals(LineString([(5, 3), (5, 10)]))
    assert second.line.equals(LineString([(6, 3), (6, 10)]))


def test_two_corners_that_point_at_each_other_are_no_gap() -> None:
    assert borders_of([box(0, 0, 5, 10), box(6, 9.5, 11, 20)]) == []
    diamond = Polygon([(6, 5), (10, 9), (14, 5), (10, 1)])
    assert borders_of([box(0, 0, 5, 10), diamond]) == []


def test_a_unit_that_stands_in_the_gap_ends_it() -> None:
    row = [box(0, 0, 5, 10), box(5.5, 0, 6.5, 10), box(7, 0, 12, 10)]
    assert {b.units for b in borders_of(row)} == {(0, 1), (1, 0), (1, 2), (2, 1)}


def test_vertices_of_others_on_a_border_do_not_break_it() -> None:
    left = Polygon([(0, 0), (5, 0), (5, 4), (5, 7), (5, 10), (0, 10)])
    (border,) = borders_of([left, box(5, 0, 10, 10)])
    assert border.line.length == pytest.approx(10)
    assert main_direction(border.line) == pytest.approx(90)


def test_borders_survive_rounded_coordinates() -> None:
    (border,) = borders_of([box(0, 0, 5, 10), box(5.004, 0, 10, 10)])
    assert border.gap_m == 0
    assert border.line.length == pytest.approx(10, abs=0.1)


def test_direction_is_that_of_the_longest_straight_part() -> None:
    assert main_direction(LineString([(0, 0), (1, 0), (1, 5)])) == pytest.approx(90)
    assert main_direction(LineString([(0, 0), (-3, -3)])) == pytest.approx(45)
    assert angle_between(179, 1) == pytest.approx(2)
    assert angle_between(10, 100) == pytest.approx(90)


def test_traces_come_from_the_line_that_runs_along_and_a_gap_takes_them_twice() -> None:
    units = [box(0, 0, 5, 10), box(5, 0, 10, 10), box(11, 0, 16, 10), box(16, 0, 20, 10)]
    marked = [
        (LineString([(5, 0), (5, 10)]), frozenset({"height"})),
        (LineString([(10.5, 0), (10.5, 10)]), frozenset({"gap"})),
        (LineString([(12, 5), (20, 5)]), frozenset({"roof"})),  # crosses the last border
    ]
    traces = {b.units: b.traces for b in with_traces(borders_of(units), marked)}
    assert traces == {(0, 1): {"height"}, (1, 2): {"gap"}, (2, 1): {"gap"}, (2, 3): None}
    assert with_traces(borders_of(units), []) == borders_of(units)


def test_the_order_of_rings_does_not_matter() -> None:
    a, b = box(0, 0, 5, 10), box(6, 0, 11, 10)
    turned = [shapely.reverse(a), shapely.reverse(b)]
    assert [(x.units, x.gap_m) for x in borders_of(turned)] == [(x.units, x.gap_m) for x in borders_of([a, b])]
