from __future__ import annotations

import numpy as np

from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud
from cityflow.surface.noise import NoiseParameters, clean
from cityflow.surface.rasterise import (
    count_points,
    fill_holes,
    highest,
    lowest,
    sums_around,
)

GRID = Grid(0.0, 2.0, 1.0, 2, 2)


def cloud() -> PointCloud:
    xyz = np.array([[0.5, 1.5, 9.0], [0.5, 1.5, 4.0], [0.4, 1.6, 5.0], [1.5, 0.5, 2.0]])
    number, of = np.array([1, 2, 1, 2], np.uint8), np.array([2, 2, 1, 2], np.uint8)
    return PointCloud(xyz, np.zeros(4, np.uint8), number, of)


def test_top_bottom_and_counts_by_hand() -> None:
    nan = np.nan
    np.testing.assert_array_equal(highest(cloud(), GRID), [[9, nan], [nan, 2]])
    np.testing.assert_array_equal(lowest(cloud(), GRID), [[4, nan], [nan, 2]])
    np.testing.assert_array_equal(count_points(cloud(), GRID), [[3, 0], [0, 1]])


def test_holes_take_the_lower_median_and_stay_open_far_from_points() -> None:
    values = np.full((5, 9), np.nan)
    values[:, 0], values[:, 2] = 10.0, 2.0
    filled = fill_holes(values, 2)
    assert (filled[:, 1] == 2.0).all()
    assert (filled[:, 3:5] == 2.0).all()
    assert np.isnan(filled[:, 6:]).all()


def test_isolated_points_go_and_sparse_water_stays() -> None:
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(0, 40, (6400, 2)), rng.normal(10, 0.02, 6400)])
    bird, pit = np.array([[20.0, 20.0, 60.0]]), np.array([[10.0, 10.0, 2.0]])
    water = np.column_stack([rng.uniform(60, 100, (160, 2)), np.full(160, 8.0)])
    broken = np.array([[5.0, 5.0, np.nan]])
    xyz = np.concatenate([ground, bird, pit, water, broken])
    kept, dropped = clean(PointCloud.of(xyz), NoiseParameters())
    assert dropped == 1
    assert kept.xyz[:, 2].max() < 11
    assert kept.xyz[:, 2].min() > 7
    assert len(kept) > 6400 + 150


def test_sums_are_the_same_wherever_the_array_begins() -> None:
    counts = np.random.default_rng(4).integers(0, 9, (60, 200))
    whole = sums_around(counts, 3, "nearest")
    np.testing.assert_array_equal(whole[1:-1, 1:-1], [
        [counts[r - 1 : r + 2, c - 1 : c + 2].sum() for c in range(1, 199)] for r in range(1, 59)
    ])  # fmt: skip
    np.testing.assert_array_equal(sums_around(counts[:, 37:], 3, "nearest")[:, 1:], whole[:, 38:])
