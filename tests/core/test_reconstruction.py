from __future__ import annotations

import numpy as np
import pytest
from shapely import box

from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence


@pytest.mark.parametrize(("alike_m", "worth"), [(0.0, 400.0), (0.1, 400.0), (1.0, 100.0), (5.0, 4.0)])
def test_points_alike_are_worth_no_more_than_the_cells_they_fill(alike_m: float, worth: float) -> None:
    """400 points on 100 m²: 100 cells of a metre, 4 of five."""
    points = PointCloud.of(np.zeros((400, 3)))
    assert Evidence("a", box(0, 0, 10, 10), points, 0.0, alike_m=alike_m).observations == pytest.approx(worth)


def test_defaults_of_two_units_are_not_shared() -> None:
    one, other = (Evidence(i, box(0, 0, 1, 1), PointCloud.empty(), 0.0) for i in "ab")
    assert one.walls is not other.walls
    assert len(one.around) == len(other.walls) == 0
