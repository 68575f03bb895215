from __future__ import annotations

import io
import json

import laspy
import numpy as np
import pytest

from cityflow.core.depth_map import ImagePoints
from cityflow.io.points.las_image_points import write_image_points


def _points(n: int, bands: int = 3) -> ImagePoints:
    rng = np.random.default_rng(n)
    xyz = np.array([341000.0, 548000.0, 80.0]) + rng.uniform(0, 50, (n, 3))
    colour = rng.integers(0, 256, (n, bands)).astype(np.uint8)
    sigma, views = rng.uniform(0.01, 0.3, n).astype(np.float32), rng.integers(1, 7, n).astype(np.uint8)
    return ImagePoints(xyz, colour, rng.integers(0, 2, n), views, sigma, ("a", "b"), np.zeros((2, 3)))


@pytest.mark.parametrize("bands", [1, 3, 4])
def test_everything_comes_back(bands: int) -> None:
    points = _points(500, bands)
    classes = np.full(500, 6, np.uint8)
    found = laspy.read(io.BytesIO(write_image_points(points, classes)))
    np.testing.assert_allclose(found.xyz, points.xyz, atol=0.0006)
    np.testing.assert_array_equal(found.classification, classes)
    np.testing.assert_array_equal(found.user_data, points.views)
    np.testing.assert_array_equal(found.point_source_id, points.image + 1)
    np.testing.assert_allclose(found["sigma"], points.sigma)
    np.testing.assert_array_equal(found.green // 257, points.colour[:, min(1, bands - 1)])
    names = next(v for v in found.header.vlrs if v.user_id == "cityflow")
    assert json.loads(names.record_data_bytes()) == ["a", "b"]
    assert (found.point_format.id == 8) == (bands == 4)


def test_no_points_are_a_file_too() -> None:
    assert len(laspy.read(io.BytesIO(write_image_points(_points(0), np.empty(0, np.uint8)))).points) == 0


def test_the_same_points_give_the_same_bytes() -> None:
    classes = np.zeros(64, np.uint8)
    assert write_image_points(_points(64), classes) == write_image_points(_points(64), classes)
