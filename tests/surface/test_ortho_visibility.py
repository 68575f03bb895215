"""What hides a place: the short way tells the same as the walk along the ray."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.geometry.ray_march import Ray, march
from cityflow.surface.ortho_visibility import Obstacles, _near_hidden, is_hidden, obstacles

ROWS, COLS, CELL = 203, 170, 0.1


@njit(cache=False)
def _both(surface, places, rays):  # type: ignore[no-untyped-def]
    short, whole = np.zeros(len(places), np.bool_), np.zeros(len(places), np.bool_)
    for i in range(len(places)):
        (x, y, z), (dx, dy, dz) = places[i], rays[i]
        short[i] = is_hidden(surface, x, y, z, dx, dy, dz)
        flat = np.sqrt(dx * dx + dy * dy)
        ray = Ray(x, y, z, dx / flat, dy / flat, dz / flat)
        end = min(surface.reach, flat)
        near = min(surface.radius, end)
        whole[i] = _near_hidden(surface, ray, near) or march(surface.columns, ray, near, end, surface.tolerance)
    return short, whole


def _surface(slant: float, widened: int, reach_m: float) -> tuple[Obstacles, FloatArray]:
    rng = np.random.default_rng(3)
    row, col = np.mgrid[:ROWS, :COLS]
    heights = 50.0 + slant * CELL * row - 0.3 * slant * CELL * col + rng.normal(0.0, 0.03, (ROWS, COLS))
    for r, c, size, height in ((40, 50, 25, 6.0), (120, 90, 30, 9.0), (160, 20, 4, 15.0)):
        heights[r : r + size, c : c + size] += height
    heights[rng.random(heights.shape) < 0.1] = np.nan
    heights[80:100, :30] = np.nan
    grid = Grid(1000.0, 2000.0, CELL, ROWS, COLS)
    origin = np.array([1001.0, 1999.0, 0.0])
    return obstacles(grid, heights.astype(np.float32), origin, widened, 1.5 * CELL, reach_m), heights


@pytest.mark.parametrize("slant", [0.0, 1.0, -0.7])
@pytest.mark.parametrize(("widened", "reach_m"), [(1, 60.0), (0, 4.0), (10, 60.0)])
def test_the_short_way_tells_the_same_as_the_walk(slant: float, widened: int, reach_m: float) -> None:
    surface, heights = _surface(slant, widened, reach_m)
    rng = np.random.default_rng(5)
    row, col = rng.uniform(-2, ROWS + 2, 20_000), rng.uniform(-2, COLS + 2, 20_000)
    r, c = np.clip(row.astype(int), 0, ROWS - 1), np.clip(col.astype(int), 0, COLS - 1)
    z = np.where(np.isnan(heights[r, c]), 50.0, heights[r, c]) + rng.normal(0.0, 0.02, len(row))
    places = np.column_stack([col * CELL - 1.0, 1.0 - row * CELL, z])
    rays = np.column_stack([rng.normal(0.0, 40.0, (len(row), 2)), rng.uniform(3.0, 100.0, len(row))])
    short, whole = _both(surface, places, rays)
    np.testing.assert_array_equal(short, whole)
    assert 0.02 < whole.mean() < 0.9
