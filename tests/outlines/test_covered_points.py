"""Points under something higher."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.depth_map import ImagePoints
from cityflow.outlines.from_walls.covered_points import find_covered_points

CORNER = np.array([85_000.0, 447_000.0, 3.0])
DEEP, SOFFIT, TOP = 3.0, 3.4, 7.0


def _image_points(xyz: FloatArray, views: int = 3) -> ImagePoints:
    n = len(xyz)
    return ImagePoints(
        xyz, np.zeros((n, 3), np.uint8), np.zeros(n, np.int64), np.full(n, views, np.uint8), np.full(n, 0.05, np.float32),
        ("a",), np.zeros((1, 3)),
    )  # fmt: skip


def _arcade(noise: float = 0.05) -> FloatArray:
    """A house of 10 by 8 m with an arcade at x < 3, the ground around it; 60 points a square metre."""
    rng = np.random.default_rng(5)

    def sheet(low: tuple[float, float, float], high: tuple[float, float, float]) -> FloatArray:
        span = np.subtract(high, low)
        area = float(np.prod(span[span > 0]))
        count = int(60 * area)
        made: FloatArray = rng.uniform(low, high, (count, 3)) + rng.normal(0, noise, (count, 3))
        return made

    parts = [
        sheet((0, 0, TOP), (10, 8, TOP)), sheet((-6, -3, 0), (DEEP, 11, 0)), sheet((DEEP, 0, 0), (DEEP, 8, 1.5)),
        sheet((0, 0, SOFFIT), (0, 8, TOP)),
    ]  # fmt: skip
    return np.asarray(np.concatenate(parts) + CORNER, np.float64)


def test_the_ground_of_an_arcade_is_found_and_no_other() -> None:
    found = find_covered_points(_image_points(_arcade())) - CORNER
    inside = (found[:, 0] > -0.3) & (found[:, 0] < DEEP + 0.3) & (found[:, 1] > -0.3) & (found[:, 1] < 8.3)
    assert inside.all()
    assert np.abs(found[:, 2]).max() < 0.3
    cells = np.unique(np.floor(found[:, :2] / 0.5), axis=0)
    assert len(cells) > 0.8 * (DEEP / 0.5) * (8 / 0.5)


@pytest.mark.parametrize("kept", [slice(None), slice(None, None, -1)])
def test_the_order_of_points_does_not_matter(kept: slice) -> None:
    xyz = _arcade()
    assert np.array_equal(find_covered_points(_image_points(xyz[kept])), find_covered_points(_image_points(xyz)))


def test_another_extent_gives_the_same_points_inside() -> None:
    xyz = _arcade()
    part = xyz[xyz[:, 1] < CORNER[1] + 5.0]
    whole, cut = (find_covered_points(_image_points(p)) for p in (xyz, part))
    below = CORNER[1] + 4.5
    assert np.array_equal(whole[whole[:, 1] < below], cut[cut[:, 1] < below])


def test_points_that_no_other_image_agrees_on_are_left_out() -> None:
    assert len(find_covered_points(_image_points(_arcade(), views=1))) == 0


def test_nothing_comes_of_nothing() -> None:
    assert find_covered_points(_image_points(np.empty((0, 3)))).shape == (0, 3)
