from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cityflow.core.grid import Grid
from cityflow.surface.gridding import bridge_gaps, terrain_from_points
from cityflow.surface.sample import sample

GRID = Grid(1000.0, 2040.0, 0.5, 80, 80)
slopes = st.floats(-0.6, 0.6)


@settings(deadline=None, max_examples=25)
@given(slopes, slopes, st.integers(0, 1000))
def test_a_plane_comes_back_also_across_a_gap(a: float, b: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    xy = rng.uniform((998, 1998), (1042, 2042), (12000, 2))
    gap = (np.abs(xy[:, 0] - 1020) < 6) & (np.abs(xy[:, 1] - 2020) < 4)
    xy = xy[~gap]
    z = 50 + a * (xy[:, 0] - 1000) + b * (xy[:, 1] - 2000)
    found = terrain_from_points(np.column_stack([xy, z]), GRID)
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    off = np.abs(found - (50 + a * (x - 1000) + b * (y - 2000)))
    # At the rims of the gap few points are left to fit a plane to.
    assert np.mean(off < 0.01) > 0.9
    assert off.max() < 0.6


def test_gaps_are_bridged_the_same_in_a_part_of_the_raster() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(0, 1, GRID.shape)
    values[30:50, 30:48] = np.nan
    part = Grid(GRID.x_min + 10, GRID.y_max - 10, 0.5, 50, 45)
    rows, cols = GRID.slices(part)
    np.testing.assert_allclose(bridge_gaps(values[rows, cols], part), bridge_gaps(values, GRID)[rows, cols])


def test_sample_leaves_missing_cells_out() -> None:
    grid = Grid(0.0, 2.0, 1.0, 2, 2)
    array = np.array([[np.nan, 4.0], [2.0, 4.0]])
    x, y = np.array([1.5, 1.0, 0.5, -3.0]), np.array([1.0, 1.0, 1.5, 1.0])
    np.testing.assert_allclose(sample(grid, array, x, y), [4.0, 10 / 3, np.nan, np.nan])
