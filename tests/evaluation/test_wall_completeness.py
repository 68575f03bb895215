from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import LineString, box

from cityflow.evaluation.wall_completeness import edges_of, found_along, length_found, stretches_of


def test_stretches_stand_for_the_whole_length() -> None:
    walls = stretches_of([LineString([(0, 0), (10, 0)]), LineString([(10, 0), (10, 0.1)])])
    assert walls.length.sum() == pytest.approx(10.1)
    assert (walls.xy[:-1, 1] == 0).all()
    assert walls.direction[-1].tolist() == [0, 1]


def test_edges_have_the_inside_to_the_left_and_straight_ones_are_whole() -> None:
    square = shapely.Polygon([(0, 0), (0, 10), (10, 10), (10, 4), (10, 0)], [[(4, 4), (6, 4), (6, 6), (4, 6)]])
    edges = edges_of([square])
    assert len(edges) == 8
    for edge in edges:
        (x, y), (u, v) = edge.coords
        d = np.array([u - x, v - y]) / edge.length
        left = shapely.Point((x + u) / 2 - 0.1 * d[1], (y + v) / 2 + 0.1 * d[0])
        assert square.contains(left)


def test_length_found_of_a_case_worked_out_by_hand() -> None:
    walls = stretches_of(edges_of([box(0, 0, 10, 10)]))
    assert length_found([box(0, 0, 10, 10)], walls, 0.24) == 1
    # of the west, south and north walls all is found but the last two metres, of the east wall nothing
    assert length_found([box(0.2, 0, 8, 10)], walls, 0.24) == pytest.approx((10 + 8.24 + 8.24) / 40, abs=0.02)
    assert length_found([box(0.3, 0.3, 9.7, 9.7)], walls, 0.24) == 0


def test_an_edge_that_only_crosses_a_wall_does_not_find_it() -> None:
    walls = stretches_of([LineString([(0, 0), (10, 0)])])
    crossing = box(4, -5, 6, 5)
    assert not found_along([crossing], walls, 1.0).any()
    assert found_along([box(0, 0.5, 10, 5)], walls, 1.0).all()


def test_nothing_found_and_nothing_to_find() -> None:
    walls = stretches_of([LineString([(0, 0), (10, 0)])])
    assert length_found([], walls, 1.0) == 0
    assert np.isnan(length_found([box(0, 0, 1, 1)], stretches_of([]), 1.0))
    assert edges_of([]) == []
