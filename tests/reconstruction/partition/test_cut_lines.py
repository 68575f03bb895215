from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box
from shapely.affinity import rotate

from cityflow.reconstruction.partition.borders import find_borders, stretches
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.cut_lines import (
    intersection_lines,
    main_directions,
    on_outline,
    outline_extensions,
    without_doubles,
)
from cityflow.reconstruction.partition.step_lines import step_lines
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from roof_cases import ORIGIN, RoofCase, roof_cases

CASES = roof_cases()
ELL = Polygon([(0, 0), (14, 0), (14, 7), (7, 7), (7, 13), (0, 13)])


def crossings_of(segments: PlaneSegments) -> list[CutLine]:
    lines, _ = intersection_lines(segments, find_borders(segments, 1.0, 4.0), 0.8, 1.0)
    return lines


def distance(line: CutLine, x: float, y: float) -> float:
    return abs(line.side(x, y))


@pytest.mark.parametrize("gap", [0.0, 1.0])
def test_ridge_is_found_across_a_gap_without_planes(gap: float) -> None:
    (ridge,) = crossings_of(CASES["gable"].segments(0, gap=gap))
    assert distance(ridge, 0, 4) < 1e-9
    assert distance(ridge, 12, 4) < 1e-9
    assert ridge.end - ridge.start > 9
    assert ridge.is_crossing


def test_planes_that_do_not_touch_have_no_intersection() -> None:
    """Gables at two heights: the ridges, but not where far planes would meet."""
    lines = crossings_of(CASES["gables at two heights"].segments(0))
    assert len(lines) == 2
    assert all(distance(line, 5, 4) < 1e-9 for line in lines)


def test_parallel_planes_have_no_intersection() -> None:
    assert crossings_of(CASES["step"].segments(0)) == []


@pytest.mark.parametrize("angle", [0.0, 17.0, 80.0])
def test_step_line_lies_between_the_points(angle: float) -> None:
    house = rotate(box(0, 0, 12, 8), angle, origin=(0, 0))
    low, high = (rotate(b, angle, origin=(0, 0)) for b in (box(0, 0, 5, 8), box(5, 0, 12, 8)))
    segments = RoofCase(house, ((low, (0.0, 0.0, 5.0)), (high, (0.0, 0.0, 8.0)))).segments(0)
    lines = step_lines(find_borders(segments, 1.0, 4.0), main_directions(house), 1.0, 20)
    a = np.radians(angle)
    for along in (1.0, 7.0):
        x, y = 5 * np.cos(a) - along * np.sin(a), 5 * np.sin(a) + along * np.cos(a)
        assert distance(lines[0], float(x), float(y)) < 0.15
    assert lines[0].support > 6


def test_tower_has_four_step_lines() -> None:
    segments = CASES["tower"].segments(0)
    lines = step_lines(find_borders(segments, 1.0, 4.0), main_directions(box(0, 0, 12, 8)), 1.0, 20)
    for x, y in [(4, 4), (8, 4), (6, 2), (6, 6)]:
        assert min(distance(line, x, y) for line in lines) < 0.15


def test_directions_are_the_outlines_own() -> None:
    turned = rotate(ELL, 25)
    assert sorted(np.degrees(main_directions(turned))) == pytest.approx([25, 115])


def test_short_jogs_give_no_direction() -> None:
    nick = Polygon([(0, 0), (12, 0), (12, 8), (0.5, 8), (0, 7.2)])
    assert len(main_directions(nick)) == 2


def test_round_outline_has_a_dozen_directions() -> None:
    circle = box(0, 0, 0, 0).centroid.buffer(5, quad_segs=40)
    assert len(main_directions(circle)) == 12


def test_extensions_start_at_the_concave_corner_only() -> None:
    lines = outline_extensions(ELL, 1.0)
    assert len(lines) == 2
    for line in lines:
        assert distance(line, 7, 7) < 1e-9
        assert line.at(line.start) == pytest.approx((7, 7))
        assert ELL.contains_properly(box(*line.at(line.end), *line.at(line.end)).centroid)
    assert outline_extensions(box(0, 0, 5, 5), 1.0) == []


def test_corners_of_a_courtyard_are_concave() -> None:
    court = Polygon(box(0, 0, 20, 16).exterior.coords, [box(6, 6, 14, 10).exterior.coords])
    assert len(outline_extensions(court, 1.0)) == 8


def test_near_line_moves_onto_the_outline() -> None:
    line = CutLine(0.0, 1.0, 7.2, -6.0, -1.0, 5.0)
    (moved,) = on_outline([line], ELL, 0.3)
    assert distance(moved, 7, 7) < 1e-9
    far = CutLine(0.0, 1.0, 5.0, -6.0, -1.0, 5.0)
    assert on_outline([far], ELL, 0.3) == [far]


def test_of_two_lines_that_coincide_the_first_stays() -> None:
    first, second = CutLine(0.0, 1.0, 5.0, -6.0, -3.0, 5.0), CutLine(0.0, -1.0, -5.05, 1.0, 4.0, 2.0)
    across = CutLine(1.0, 0.0, 5.0, 0.0, 4.0, 1.0)
    kept = without_doubles([first, second, across], 0.1)
    assert [k.offset for k in kept] == [5.0, 5.0]
    assert (kept[0].start, kept[0].end) == pytest.approx((-6.0, -1.0))


def test_stretches_by_hand() -> None:
    assert stretches(np.array([0.0, 1, 2, 9, 10, 11, 30]), 2.0) == [(0, 2), (9, 11)]
    assert stretches(np.array([0.0, 1]), 2.0) == []


def test_one_line_of_points_has_borders() -> None:
    x = np.arange(0, 10, 0.3)
    points = np.column_stack([x, np.zeros(len(x)), np.where(x < 5, 3.0, 6.0)])
    planes = np.array([[0.0, 0, 3], [0, 0, 6]])
    segments = PlaneSegments(ORIGIN, points, (x >= 5).astype(np.int64), planes, np.zeros(2), 0.02)
    borders = find_borders(segments, 1.0, 4.0)
    assert len(borders) > 0
    assert np.all(np.abs(borders.middle[:, 0] - 5) < 0.6)
