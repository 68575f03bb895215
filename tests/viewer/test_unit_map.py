from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.building import Status
from cityflow.viewer.report_rows import ReportData, UnitRow
from cityflow.viewer.unit_map import UNITS_PER_METRE, colour_scales, draw_map


def decoded(path: str) -> list[np.ndarray]:
    rings = []
    for part in re.findall(r"M([^z]*)z", path):
        start, steps = part.split("l")
        numbers = np.array([int(n) for n in re.findall(r"-?\d+", steps)]).reshape(-1, 2)
        rings.append(np.cumsum(np.vstack([[int(n) for n in start.split()], numbers]), axis=0) / UNITS_PER_METRE)
    return rings


def test_outlines_keep_their_shape_and_their_place_to_each_other(small_town: ReportData) -> None:
    drawn = draw_map(small_town.units)
    first = drawn.shapes[0]
    anchor = decoded(first.path)[0][0] * [1, -1] - small_town.units[first.row].rings[0][0]
    for shape in drawn.shapes:
        (ring,) = decoded(shape.path)
        expected = small_town.units[shape.row].rings[0] + anchor
        assert np.abs(ring * [1, -1] - expected).max() < 0.11
        assert ring.min() >= 0
        assert (ring.max(axis=0) <= np.array([drawn.width, drawn.height]) / UNITS_PER_METRE).all()


def test_refused_outlines_lie_below_and_those_far_off_are_left_out(small_town: ReportData) -> None:
    town = [u for u in small_town.units if u.status is not Status.REFUSED]
    ring = town[0].rings[0]
    twin = replace(town[0], id="twin", status=Status.REFUSED)
    far = replace(twin, id="far", rings=(ring + 50_000.0,))
    alone, drawn = draw_map(town), draw_map([*town, twin, far])
    assert (drawn.width, drawn.height) == (alone.width, alone.height)
    assert drawn.shapes[0].row == len(town)
    assert len(town) + 1 not in [s.row for s in drawn.shapes]
    assert len(draw_map([twin, far]).shapes) == 2


def test_holes_are_drawn_as_further_rings() -> None:
    square = np.array([(0, 0), (10, 0), (10, 10), (0, 10)], np.float64)
    unit = UnitRow("a", "0_0", Status.DONE, rings=(square, (square[::-1] * 0.4) + 3))
    (shape,) = draw_map([unit]).shapes
    outer, inner = decoded(shape.path)
    assert np.ptp(outer, axis=0).tolist() == [10, 10]
    assert np.ptp(inner, axis=0).tolist() == [4, 4]


def test_what_needs_attention_is_drawn_last(small_town: ReportData) -> None:
    last = [small_town.units[s.row].status for s in draw_map(small_town.units).shapes][-1]
    assert last is Status.FAILED


@pytest.mark.parametrize(("nmad", "expected"), [(None, "nx"), (0.0, "n0"), (0.019, "n0"), (0.02, "n1"), (0.5, "n5")])
def test_classes_of_the_colour_scale(small_town: ReportData, nmad: float | None, expected: str) -> None:
    unit = replace(small_town.units[0], nmad=nmad)
    assert expected in draw_map([unit]).shapes[0].classes.split()


@pytest.mark.parametrize("seconds", [0.0, 0.001, 0.06, 3.0, 5000.0])
def test_time_has_six_classes_round_its_median(seconds: float) -> None:
    scale = colour_scales([UnitRow("a", "0_0", Status.DONE, seconds=seconds)])[2]
    assert len(scale.labels) == 6
    assert len(scale.breaks) == 5


def test_units_without_outline_are_left_out() -> None:
    assert draw_map([UnitRow("a", "0_0", Status.REFUSED)]).shapes == ()


def test_what_lies_below_the_outlines_stands_where_they_stand(small_town: ReportData) -> None:
    ring = small_town.units[0].rings[0]
    low, high = ring.min(axis=0), ring.max(axis=0)
    drawn = draw_map(small_town.units, under=(low[0], low[1], high[0], high[1]))
    shape = next(s for s in drawn.shapes if s.row == 0)
    (found,) = decoded(shape.path)
    assert drawn.under is not None
    x, y, width, height = np.array(drawn.under) / UNITS_PER_METRE
    assert np.allclose([x, y], found.min(axis=0), atol=0.11)
    assert np.allclose([x + width, y + height], found.max(axis=0), atol=0.11)
    assert draw_map(small_town.units).under is None
