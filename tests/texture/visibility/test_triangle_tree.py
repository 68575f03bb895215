"""Rays against triangles in a tree, compared with every triangle tried."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.texture.visibility.triangle_tree import meets_triangle, triangle_tree


def _tried(corners: FloatArray, p: FloatArray, d: FloatArray, length: float) -> tuple[bool, float]:
    """Whether any triangle is met, and how far the nearest decision was from turning out otherwise."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    t = np.sum((a - p) * normal, axis=1) / (normal @ d)
    at = p + t[:, None] * d
    area = np.sum(normal**2, axis=1)
    weights = [np.sum(np.cross(v - u, at - u) * normal, axis=1) / area for u, v in ((a, b), (b, c), (c, a))]
    least = np.min([*weights, t, length - t], axis=0)
    return bool(np.any(least > 0)), float(np.min(np.abs(least)))


@pytest.mark.parametrize("count", [1, 3, 70])
def test_a_ray_meets_what_it_meets_when_all_are_tried(count: int) -> None:
    rng = np.random.default_rng(count)
    corners = rng.uniform(-10, 10, (count, 1, 3)) + rng.uniform(-3, 3, (count, 3, 3))
    tree = triangle_tree(corners)
    judged = hits = 0
    for _ in range(400):
        p, length = rng.uniform(-15, 15, 3), rng.uniform(1, 40)
        d = corners[rng.integers(count)].mean(axis=0) + rng.normal(size=3) - p
        d /= np.linalg.norm(d)
        expected, doubt = _tried(corners, p, d, length)
        if doubt > 1e-7:
            assert (meets_triangle(tree, p, d, length, -1) >= 0) == expected
            judged, hits = judged + 1, hits + expected
    assert judged > 350
    assert 20 < hits < judged


def test_level_and_upright_rays_find_level_and_upright_triangles() -> None:
    wall = np.array([[[5.0, -1, -1], [5.0, 1, -1], [5.0, 0, 2]], [[-1.0, -1, 7], [1.0, -1, 7], [0.0, 2, 7]]])
    tree = triangle_tree(wall)
    assert meets_triangle(tree, np.zeros(3), np.array([1.0, 0, 0]), 10.0, -1) >= 0
    assert meets_triangle(tree, np.zeros(3), np.array([1.0, 0, 0]), 4.9, -1) < 0
    assert meets_triangle(tree, np.zeros(3), np.array([0.0, 0, 1.0]), 1e7, -1) >= 0
    assert meets_triangle(tree, np.zeros(3), np.array([0.0, 0, -1.0]), 1e7, -1) < 0


def test_no_ray_slips_between_triangles_that_share_an_edge() -> None:
    """A sheet of many small triangles, rays through their corners and edges."""
    steps = np.arange(9.0)
    quads = [(x, y) for x in steps for y in steps]
    corners = [[(x, y, 0), (x + 1, y, 0), (x + 1, y + 1, 0)] for x, y in quads]
    corners += [[(x, y, 0), (x + 1, y + 1, 0), (x, y + 1, 0)] for x, y in quads]
    tree = triangle_tree(np.array(corners, float) * 0.3 + 0.1)
    rng = np.random.default_rng(4)
    for _ in range(500):
        on = rng.integers(1, 9, 2).astype(float)
        on[rng.integers(2)] += rng.choice([0.0, 0.37])
        start = rng.uniform(-2, 4, 3) * (1, 1, 0) + (0, 0, 5.0)
        towards = np.array([*(on * 0.3 + 0.1), 0.0]) - start
        length = float(np.linalg.norm(towards))
        assert meets_triangle(tree, start, towards / length, length + 1.0, -1) >= 0


def test_without_triangles_nothing_is_met() -> None:
    assert meets_triangle(triangle_tree(np.empty((0, 3, 3))), np.zeros(3), np.array([1.0, 0, 0]), 1.0, -1) == -1
