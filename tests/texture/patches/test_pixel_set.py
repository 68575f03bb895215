from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.texture.patches.pixel_set import depth_inside


def star(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 9))
    reach = rng.uniform(15, 34, 9)
    outer = np.column_stack([40 + reach * np.cos(angle), 36 + reach * np.sin(angle)])
    hole = np.array([[38.0, 34.2], [38.5, 40.0], [43.0, 36.0]])
    return [outer, hole] if shapely.Polygon(outer).contains(shapely.Polygon(hole)) else [outer]


@pytest.mark.parametrize("seed", range(6))
def test_depths_are_distances_from_the_boundary(seed: int) -> None:
    rings = star(seed)
    found = depth_inside(rings, 72, 80, 4.0)
    polygon = shapely.Polygon(rings[0], rings[1:])
    row, col = np.mgrid[:72, :80] + 0.5
    points = shapely.points(col, row)
    truth = np.minimum(shapely.distance(polygon.boundary, points), 4.0)
    truth = np.where(shapely.contains(polygon, points), truth, -truth)
    assert found == pytest.approx(truth, abs=1e-5)


def test_polygons_between_pixels_have_depth_near_zero() -> None:
    found = depth_inside([np.array([[3.1, 3.1], [3.3, 3.1], [3.3, 3.3]])], 8, 8, 3.0)
    assert (found <= 0).all()
    assert found[3, 3] == pytest.approx(-np.hypot(0.2, 0.2), abs=1e-6)


def test_edges_along_pixel_centres_and_beyond_the_raster_do_no_harm() -> None:
    found = depth_inside([np.array([[-5.0, 2.5], [20.0, 2.5], [20.0, 6.5], [-5.0, 6.5]])], 9, 10, 2.0)
    assert found[4].tolist() == [2.0] * 10
    assert (found[:2] < 0).all()
    assert (found[3] == 1.0).all()
