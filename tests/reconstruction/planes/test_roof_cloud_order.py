"""Thinning sorts by two keys where five were; the order is the same."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.reconstruction.planes.roof_cloud import _by_cell_and_height, thin


@pytest.mark.parametrize("levels", [3, 10**9])
def test_points_are_in_the_order_of_cell_height_and_place(levels: int) -> None:
    """With few levels many heights of a cell are the same."""
    rng = np.random.default_rng(levels)
    points = np.column_stack([rng.uniform(0, 5, (3000, 2)), rng.integers(0, levels, 3000).astype(float)])
    points = np.concatenate([points, points[:20]])
    col, row = (np.floor(points[:, k] / 0.4).astype(np.int64) for k in (0, 1))
    order = _by_cell_and_height(points, col, row)
    assert np.array_equal(points[order], points[np.lexsort((points[:, 1], points[:, 0], points[:, 2], col, row))])
    assert np.array_equal(thin(points, 0.4), thin(points[rng.permutation(len(points))], 0.4))
