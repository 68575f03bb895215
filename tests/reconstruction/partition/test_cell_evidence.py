from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from cityflow.reconstruction.partition.cell_evidence import edges_of_cells, plane_costs, points_in_cells, wild_areas
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.subdivision import Subdivision

YARD = Polygon(box(0, 0, 10, 8).exterior.coords, [box(3, 3, 6, 5).exterior.coords])


def test_points_fall_into_the_cells_that_hold_them() -> None:
    division = Subdivision.of_polygon(YARD)
    for line in (CutLine(0.6, 0.8, 5.0, -99.0, 99.0, 1.0), CutLine(-0.8, 0.6, -2.0, -99.0, 99.0, 1.0)):
        for number in list(division.cells):
            division.cut(number, line)
    x, y = np.random.default_rng(0).uniform(-1, 11, (2, 2000))
    numbers = list(division.cells)
    found = points_in_cells(division, numbers, x, y)
    for k, number in enumerate(numbers):
        assert np.array_equal(found == k, shapely.contains_xy(division.polygon(number), x, y))
    assert np.array_equal(found >= 0, shapely.contains_xy(YARD, x, y))


def test_costs_by_hand() -> None:
    points = np.array([[0.0, 0, 5.0], [1.0, 0, 5.1], [2.0, 0, 9.0], [3.0, 0, 5.0]])
    planes = np.array([[0.0, 0, 5.0], [1.0, 0, 5.0]])
    cost = plane_costs(points, np.array([0, 0, 1, -1]), planes, 0.2, 2)
    assert cost == pytest.approx(np.array([[0.25, 1.0], [1.0, 1.0]]))


def test_wild_areas_are_those_of_the_clipped_cells() -> None:
    court = Polygon([(0, 0), (9, 1), (8, 7), (3, 9), (-1, 6)], [[(3, 3), (5, 3), (5, 5), (3, 5)]])
    division = Subdivision.of_polygon(court)
    division.cut(next(iter(division.cells)), CutLine(0.6, 0.8, 5.0, -99.0, 99.0, 1.0))
    cells = list(division.cells)
    assert len(cells) > 1
    planes = np.array([[0.4, -0.7, 3.0], [0.0, 0.9, -1.0], [-1.5, 0.2, 4.0], [0, 0, 1.0], [0, 0, 9.0], [0, 0, -5.0]])
    lowest, highest = -1.0, 4.0
    found = wild_areas(*edges_of_cells(division, cells), planes, lowest, highest)
    for row, cell in zip(found, cells, strict=True):
        polygon = division.polygon(cell)
        for wild, (a, b, c) in zip(row, planes, strict=True):
            slope = float(np.hypot(a, b))
            if slope == 0:
                expected = polygon.area * (not lowest <= c <= highest)
            else:
                level = [np.array([a, b]) / slope * ((z - c) / slope) for z in (lowest, highest)]
                along = 50 * np.array([-b, a]) / slope
                between = Polygon([level[0] - along, level[0] + along, level[1] + along, level[1] - along])
                expected = polygon.area - polygon.intersection(between).area
            assert wild == pytest.approx(expected, abs=1e-9)
