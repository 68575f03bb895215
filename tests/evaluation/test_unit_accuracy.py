from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Polygon, box
from shapely.affinity import rotate, translate

from cityflow.evaluation.unit_accuracy import FoundUnits, UnitsParameters, compare_units
from cityflow.evaluation.unit_borders import Border, borders_of

ROW = [box(5 * k, 0, 5 * k + 5, 10) for k in range(4)]
BLOCK = box(0, 0, 20, 10)
Shape = TypeVar("Shape", Polygon, LineString)


def upright(x: float, low: float = 0.0, high: float = 10.0) -> LineString:
    return LineString([(x, low), (x, high)])


def test_the_truth_itself_is_perfect() -> None:
    borders = borders_of(ROW)
    a = compare_units(FoundUnits([BLOCK], ROW, [b.line for b in borders]), ROW, borders)
    assert (len(a.hits), a.missed, a.false_alarms, a.apart, a.void) == (3, (), (), (), ())
    assert (a.all_borders.share, a.false_share, a.position_m, a.angle_deg) == (1, 0, 0, 0)
    assert (a.iou_mean, a.same_share, a.units_missing) == (1, 1, 0)


def test_figures_of_a_case_worked_out_by_hand() -> None:
    tilted = LineString([(9.8, 0), (10.2, 10)])
    lines = [upright(5.3), tilted, upright(7.5)]
    units = [box(0, 0, 5.3, 10), box(5.3, 0, 7.5, 10), box(7.5, 0, 10, 10), box(10, 0, 20, 10)]
    a = compare_units(FoundUnits([BLOCK], units, lines), ROW, borders_of(ROW))
    assert [(h.line, h.border) for h in a.hits] == [(0, 0), (1, 1)]
    assert a.hits[0].position_m == pytest.approx(0.3)
    assert a.hits[0].angle_deg == 0
    assert a.hits[1].position_m == pytest.approx(0.1, abs=0.02)
    assert a.hits[1].angle_deg == pytest.approx(np.degrees(np.arctan(0.04)))
    assert (a.missed, a.false_alarms) == ((2,), (2,))
    assert a.all_borders.share == pytest.approx(2 / 3)
    assert a.false_share == pytest.approx(1 / 3)
    assert a.unit_iou.tolist() == pytest.approx([50 / 53, 25 / 50, 0.5, 0.5])
    assert a.same_share == 0.25


def test_a_line_hits_one_border_and_a_border_is_hit_once() -> None:
    gap = [box(0, 0, 5, 10), box(5.6, 0, 10.6, 10)]
    whole = [box(0, 0, 10.6, 10)]
    one = compare_units(FoundUnits(whole, gap, [upright(5.2)]), gap, borders_of(gap))
    assert (len(one.hits), len(one.missed), len(one.false_alarms)) == (1, 1, 0)
    assert one.hits[0].position_m == pytest.approx(0.2)
    both = compare_units(FoundUnits(whole, gap, [upright(5.7), upright(4.9)]), gap, borders_of(gap))
    assert [(h.line, h.border) for h in both.hits] == [(0, 1), (1, 0)]
    twice = compare_units(
        FoundUnits([box(0, 0, 10, 10)], ROW[:2], [upright(4.9), upright(5.2)]), ROW[:2], borders_of(ROW[:2])
    )
    assert (len(twice.hits), twice.hits[0].line, twice.false_alarms) == (1, 0, (1,))


def test_as_many_borders_as_possible_are_hit() -> None:
    """The nearer line would do for both borders, the other for one alone."""
    gap = [box(0, 0, 5, 10), box(5.8, 0, 10.8, 10)]
    a = compare_units(FoundUnits([box(0, 0, 10.8, 10)], gap, [upright(5.1), upright(4.2)]), gap, borders_of(gap))
    assert len(a.hits) == 2


def test_borders_that_the_outlines_have_already_are_not_counted() -> None:
    halves = [box(0, 0, 10, 10), box(10, 0, 20, 10)]
    a = compare_units(FoundUnits(halves, halves, [upright(5), upright(10)]), ROW, borders_of(ROW))
    assert len(a.hits) == 1
    assert a.apart == (1,)
    assert a.void == (1,)
    assert a.false_alarms == ()
    assert a.all_borders.borders == 2


def test_units_without_an_outline_take_part_in_nothing() -> None:
    a = compare_units(FoundUnits([box(0, 0, 10, 10)], ROW[:2], [upright(5)]), ROW, borders_of(ROW))
    assert a.units_missing == 2
    assert len(a.unit_iou) == 2
    assert (a.all_borders.hits, a.all_borders.borders) == (1, 1)
    nothing = compare_units(FoundUnits([], [], []), ROW, borders_of(ROW))
    assert nothing.units_missing == 4
    assert np.isnan(nothing.all_borders.share)
    assert nothing.false_share == 0


@pytest.mark.parametrize(
    ("line", "hits"),
    [
        (upright(5.99), 1),
        (upright(6.01), 0),
        (upright(5, 0, 5.2), 1),
        (upright(5, 0, 3.5), 0),
        (LineString([(4.2, 0), (5.8, 10)]), 1),
        (LineString([(4.0, 0), (6.0, 10)]), 0),
        (LineString([(0, 5), (10, 5)]), 0),
    ],
)
def test_what_counts_as_a_hit(line: LineString, hits: int) -> None:
    a = compare_units(FoundUnits([BLOCK], ROW, [line]), ROW[:2], borders_of(ROW[:2]), UnitsParameters(angle_deg=10))
    assert len(a.hits) == hits


def test_sensitivity_is_told_by_kind_of_trace() -> None:
    kinds = [frozenset({"height", "roof"}), frozenset({"facade"}), frozenset[str]()]
    borders = [replace(b, traces=t) for b, t in zip(borders_of(ROW), kinds, strict=True)]
    a = compare_units(FoundUnits([BLOCK], ROW, [upright(5), upright(15)]), ROW, borders)
    assert (a.all_borders.hits, a.all_borders.borders) == (2, 3)
    assert (a.traced.hits, a.traced.borders) == (1, 2)
    assert {k: (s.hits, s.borders) for k, s in a.by_trace.items()} == {
        "height": (1, 1), "roof": (1, 1), "facade": (0, 1), "gap": (0, 0), "none": (1, 1),
    }  # fmt: skip


@settings(max_examples=40, deadline=None)
@given(
    widths=st.lists(st.floats(3, 8), min_size=2, max_size=6),
    turn=st.floats(0, 180),
    offsets=st.lists(st.floats(-3, 3), min_size=7, max_size=7),
)
def test_hits_misses_and_false_alarms_add_up(widths: list[float], turn: float, offsets: list[float]) -> None:
    edges = np.concatenate([[0], np.cumsum(widths)])
    units = [placed(box(a, 0, b, 10), turn) for a, b in pairwise(edges)]
    borders = borders_of(units)
    lines = [placed(upright(x + d), turn) for x, d in zip(edges[1:-1], offsets, strict=False)]
    a = compare_units(FoundUnits([placed(box(0, 0, edges[-1], 10), turn)], units, lines), units, borders)
    assert len(a.hits) + len(a.missed) == len(borders) == len(widths) - 1
    assert len(a.hits) + len(a.false_alarms) == len(lines)
    assert len({h.line for h in a.hits}) == len({h.border for h in a.hits}) == len(a.hits)
    assert all(h.position_m <= 1.0 and h.angle_deg < 0.01 for h in a.hits)


def placed(shape: Shape, turn: float) -> Shape:
    moved: Shape = translate(rotate(shape, turn, origin=(0, 0)), 85000, 447000)
    return moved


def test_borders_stand_as_given() -> None:
    border = Border(upright(5), (0, 1), 0.0, frozenset({"roof"}))
    a = compare_units(FoundUnits([BLOCK], ROW, []), ROW[:2], [border])
    assert a.missed == (0,)
