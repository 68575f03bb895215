from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.geometry.outline_distances import distances_to_outline

COURT = Polygon([(0, 0), (9, 1), (8, 7), (3, 6), (1, 9)], [[(3, 3), (5, 3), (4, 5)]])


def test_as_far_as_another_library_says() -> None:
    xy = np.random.default_rng(3).uniform(-4, 12, (2000, 2))
    expected = shapely.distance(shapely.points(xy), COURT)
    assert 0.1 < np.mean(expected == 0) < 0.9
    np.testing.assert_allclose(distances_to_outline(COURT, xy), expected, rtol=0, atol=1e-12)


def test_a_corner_given_twice_harms_nothing() -> None:
    twice = Polygon([(0, 0), (4, 0), (4, 0), (4, 4)])
    np.testing.assert_allclose(distances_to_outline(twice, np.array([[7.0, -4.0], [3.0, 1.0]])), [5.0, 0.0])
