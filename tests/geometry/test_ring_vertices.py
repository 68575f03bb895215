from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon, box

from cityflow.geometry.ring_vertices import with_vertices


def test_points_on_edges_become_vertices_in_order_and_bit_for_bit() -> None:
    house = Polygon(box(0, 0, 10, 10).exterior, [box(3, 3, 6, 6).exterior])
    points = np.array([[7.1234, 0.0], [2.0, 0.0004], [10.0, 5.0], [3.0, 4.5], [5.0, 1.0], [0.0, 0.0], [7.1234, 0.0]])
    grown = with_vertices(house, points)
    assert grown.is_valid
    assert len(shapely.get_coordinates(grown)) == len(shapely.get_coordinates(house)) + 4
    assert {tuple(p) for p in points[:4].tolist()} <= {tuple(v) for v in shapely.get_coordinates(grown).tolist()}
    assert abs(grown.area - house.area) < 0.01
    assert with_vertices(house, points[4:6]) is house


def test_neighbours_tie_after_it() -> None:
    a, b = box(0, 0, 10, 10), Polygon([(10, -2), (20, -2), (20, 12), (10, 12), (10, 4.321)])
    tied = with_vertices(a, shapely.get_coordinates(b)), with_vertices(b, shapely.get_coordinates(a))
    assert not shapely.coverage_is_valid([a, b])
    assert shapely.coverage_is_valid(list(tied))


def test_nothing_is_inserted_that_would_spoil_the_polygon() -> None:
    wedge = Polygon([(0, 0), (10, 0), (10, 0.0004), (5, 0.0002)])
    result = with_vertices(wedge, np.array([[7.0, 0.0009], [np.nan, np.nan]])[:1], 1e-3)
    assert result.is_valid
