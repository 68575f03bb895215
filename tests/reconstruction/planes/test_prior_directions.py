from __future__ import annotations

import math

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Direction
from cityflow.reconstruction.planes.plane_fit import solve_plane
from cityflow.reconstruction.planes.prior_directions import with_prior

TRUE = np.array([0.0, 0.7, 5.0])
SLOPE = math.degrees(math.atan(0.7))


def fitted(seed: int, size: float) -> tuple[FloatArray, FloatArray]:
    """Points of a slope that falls along y, with errors alike over a metre, and the plane through them."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, size, (int(16 * size**2), 2))
    cell = np.floor(xy).astype(int)
    z = xy @ TRUE[:2] + TRUE[2] + rng.normal(0, 0.1, (20, 20))[cell[:, 0], cell[:, 1]]
    points = np.column_stack([xy, z])
    a, b, c, sound = solve_plane(points, np.arange(len(points)))
    assert sound
    return points, np.array([[a, b, c]])


def off(planes: FloatArray) -> float:
    return float(np.hypot(*(planes[0, :2] - TRUE[:2])))


def test_true_directions_make_small_planes_better() -> None:
    before, after = [], []
    for seed in range(30):
        points, planes = fitted(seed, 4.0)
        labels = np.zeros(len(points), np.int64)
        directions = [Direction(90.0, 0.5, 1.0)], [Direction(SLOPE, 0.5, 1.0)]
        before.append(off(planes))
        after.append(off(with_prior(points, labels, planes, *directions)))
    assert np.mean(after) < 0.7 * np.mean(before)


def test_a_large_plane_hardly_moves_for_a_vague_direction() -> None:
    points, planes = fitted(1, 18.0)
    moved = with_prior(points, np.zeros(len(points), np.int64), planes, [Direction(93.0, 3.0, 1.0)], [])
    assert np.abs(moved - planes)[:, :2].max() < 0.005


def test_a_direction_that_is_not_the_planes_is_left_alone() -> None:
    points, planes = fitted(2, 8.0)
    moved = with_prior(
        points, np.zeros(len(points), np.int64), planes, [Direction(45.0, 0.5, 1.0)], [Direction(10, 0.5, 1)]
    )
    assert np.array_equal(moved, planes)


def test_the_height_over_the_middle_stays() -> None:
    points, planes = fitted(3, 4.0)
    moved = with_prior(points, np.zeros(len(points), np.int64), planes, [Direction(90.0, 0.1, 1.0)], [])
    middle = points[:, :2].mean(axis=0)
    heights = [float(p[:2] @ middle + p[2]) for p in (planes[0], moved[0])]
    assert heights[0] == pytest.approx(heights[1], abs=1e-9)
    assert not np.array_equal(moved, planes)
