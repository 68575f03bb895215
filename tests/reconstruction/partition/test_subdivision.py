from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.ring_tracing import ring_edges

YARD = Polygon(box(0, 0, 10, 8).exterior.coords, [box(3, 3, 6, 5).exterior.coords])
FORK = Polygon([(0, 0), (10, 0), (10, 8), (7, 8), (7, 3), (3, 3), (3, 8), (0, 8)])


def level(y: float, start: float = -100.0, end: float = 100.0) -> CutLine:
    """The line at a height y; positions along it are −x."""
    return CutLine(0.0, 1.0, y, -end, -start, 1.0)


def assert_conforms(division: Subdivision, outline: Polygon) -> None:
    """Every inner edge has a cell on both sides, the border edges make up the outline, and cells fill it."""
    owners = [(e, c) for c, rings in division.cells.items() for ring in rings for e in ring_edges(ring)]
    assert len(owners) == len(division.left)
    assert dict(owners) == division.left
    border = sum(division.length((u, v)) for u, v in division.left if (v, u) not in division.left)
    assert border == pytest.approx(outline.length)
    assert sum(division.area(c) for c in division.cells) == pytest.approx(outline.area, rel=1e-9)
    assert all(division.polygon(c).is_valid for c in division.cells)


def test_line_halves_a_rectangle() -> None:
    division = Subdivision.of_polygon(box(0, 0, 10, 8))
    division.cut(0, level(2))
    assert sorted(division.area(c) for c in division.cells) == pytest.approx([20, 60])


def test_line_through_vertices_adds_none() -> None:
    division = Subdivision.of_polygon(box(0, 0, 8, 8))
    division.cut(0, CutLine(-np.sqrt(0.5), np.sqrt(0.5), 0.0, -100.0, 100.0, 1.0))
    assert len(division.xy) == 4
    assert [division.area(c) for c in division.cells] == pytest.approx([32, 32])


def test_line_cuts_only_where_its_stretch_lies() -> None:
    division = Subdivision.of_polygon(FORK)
    division.cut(0, level(5, start=7.5, end=9.5))
    assert sorted(division.area(c) for c in division.cells) == pytest.approx([9, FORK.area - 9])


def test_line_across_a_hole_separates() -> None:
    division = Subdivision.of_polygon(YARD)
    division.cut(0, level(4, start=0.5, end=1.0))
    assert sorted(division.area(c) for c in division.cells) == pytest.approx([37, 37])
    assert_conforms(division, YARD)


def test_line_beside_a_hole_leaves_it_whole() -> None:
    division = Subdivision.of_polygon(YARD)
    division.cut(0, level(1))
    assert sorted(len(rings) for rings in division.cells.values()) == [1, 2]
    assert_conforms(division, YARD)


def test_neighbour_gets_the_vertex_of_a_crossing() -> None:
    division = Subdivision.of_polygon(box(0, 0, 10, 8))
    lower, upper = division.cut(0, level(4))
    if division.polygon(lower).centroid.y > 4:
        lower, upper = upper, lower
    division.cut(upper, CutLine(1.0, 0.0, 5.0, -100.0, 100.0, 1.0))
    assert len(division.cells[lower][0]) == 5
    assert_conforms(division, box(0, 0, 10, 8))


def test_merging_all_gives_the_outline_back() -> None:
    division = Subdivision.of_polygon(YARD)
    for line in (level(2), level(4), CutLine(0.6, 0.8, 6.0, -100.0, 100.0, 1.0)):
        for number in list(division.cells):
            division.cut(number, line)
    labels = division.merge(dict.fromkeys(division.cells, 7))
    division.dissolve()
    assert list(labels.values()) == [7]
    (number,) = division.cells
    assert division.polygon(number).equals(YARD)
    assert sorted(len(ring) for ring in division.cells[number]) == [4, 4]


def test_cells_around_another_get_a_hole() -> None:
    division = Subdivision.of_polygon(box(0, 0, 9, 9))
    for x in (3.0, 6.0):
        for line in (level(x), CutLine(1.0, 0.0, x, -100.0, 100.0, 1.0)):
            for number in list(division.cells):
                division.cut(number, line)
    middle = {c: int(box(3, 3, 6, 6).contains(division.polygon(c).centroid)) for c in division.cells}
    labels = division.merge(middle)
    assert sorted((label, len(division.cells[c])) for c, label in labels.items()) == [(0, 2), (1, 1)]
    assert_conforms(division, box(0, 0, 9, 9))


def test_dissolving_keeps_vertices_of_the_outline() -> None:
    outline = Polygon([(0, 0), (5, 0), (10, 0), (10, 8), (0, 8)])
    division = Subdivision.of_polygon(outline)
    division.dissolve()
    assert len(division.cells[0][0]) == 5


@given(
    st.sampled_from([box(0, 0, 10, 8), YARD, FORK]),
    st.lists(
        st.tuples(st.floats(0, 10), st.floats(0, 8), st.floats(0, np.pi), st.floats(-6, 6), st.floats(0, 12)),
        max_size=12,
    ),
)
@settings(max_examples=150, deadline=None, derandomize=True)
def test_any_cuts_leave_no_crack(outline: Polygon, cuts: list[tuple[float, float, float, float, float]]) -> None:
    division = Subdivision.of_polygon(outline)
    for x, y, angle, start, length in cuts:
        nx, ny = float(np.cos(angle)), float(np.sin(angle))
        line = CutLine(nx, ny, nx * x + ny * y, start, start + length, 1.0)
        for number in list(division.cells):
            division.cut(number, line)
    assert_conforms(division, outline)
    labels = division.merge({c: c % 3 for c in division.cells})
    division.dissolve()
    assert set(labels) == set(division.cells)
    assert sum(division.area(c) for c in division.cells) == pytest.approx(outline.area, rel=1e-6)
    union = shapely.union_all([division.polygon(c) for c in division.cells])
    assert union.symmetric_difference(outline).area < 1e-2
