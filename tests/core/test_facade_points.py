from __future__ import annotations

import numpy as np

from cityflow.core.facade_points import WallPoints, joined_walls


def walls(x: list[float]) -> WallPoints:
    """Points on a façade that looks north; sigma and views tell them apart."""
    n = len(x)
    xyz = np.column_stack([x, np.full(n, 4.0), np.arange(n)])
    normal = np.tile(np.array([0.0, 1.0], np.float32), (n, 1))
    return WallPoints(xyz, normal, np.array([0.01 * v for v in x], np.float32), np.arange(n).astype(np.uint8))


def test_a_box_holds_its_lower_edges_and_not_its_upper_ones() -> None:
    points = walls([0.0, 5.0, 10.0])
    assert points.within((0.0, 4.0, 10.0, 5.0)).xyz[:, 0].tolist() == [0, 5]
    assert len(points.within((0.0, 0.0, 20.0, 4.0))) == 0


def test_points_keep_what_belongs_to_them_and_their_order() -> None:
    both = joined_walls([walls([3.0, 1.0]), walls([]), walls([2.0])])
    assert both.xyz[:, 0].tolist() == [3, 1, 2]
    chosen = both.take(np.array([2, 0]))
    np.testing.assert_allclose(chosen.sigma, [0.02, 0.03], atol=1e-7)
    assert chosen.views.tolist() == [0, 0]
    np.testing.assert_array_equal(chosen.normal, [[0, 1], [0, 1]])


def test_no_cloud_is_an_empty_one_that_others_can_join() -> None:
    none = joined_walls([])
    assert (len(none), none.xyz.shape, none.normal.shape) == (0, (0, 3), (0, 2))
    both = joined_walls([none, walls([1.0])])
    assert [str(a.dtype) for a in (both.normal, both.sigma, both.views)] == ["float32", "float32", "uint8"]
