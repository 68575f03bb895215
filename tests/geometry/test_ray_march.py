"""Rays through columns, compared with rays walked in small steps."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.grid import Grid
from cityflow.geometry.ray_march import LOWEST, Columns, columns_over, meets_column, tops_from

GRID = Grid(100.0, 220.0, 0.5, 90, 120)
ORIGIN = np.array([130.0, 200.0, 10.0])


def _over(heights: np.ndarray) -> Columns:
    return columns_over(GRID, tops_from(heights, ORIGIN[2]), ORIGIN)


def _columns(rng: np.random.Generator) -> np.ndarray:
    heights = np.full(GRID.shape, 10.0, np.float32)
    for _ in range(25):
        r, c = rng.integers(0, 85), rng.integers(0, 115)
        heights[r : r + rng.integers(1, 8), c : c + rng.integers(1, 8)] = 10 + rng.uniform(1, 15)
    heights[rng.random(GRID.shape) < 0.02] = LOWEST
    return heights


def _walked(heights: np.ndarray, p: np.ndarray, d: np.ndarray, length: float) -> tuple[bool, float]:
    """Whether the ray is below a column anywhere, and by how much it clears or cuts the columns at least."""
    s = np.arange(0.0, min(length, 120.0), 0.004)
    at = p + s[:, None] * d
    rows, cols = GRID.indices(at[:, 0], at[:, 1])
    on = (rows >= 0) & (rows < GRID.rows) & (cols >= 0) & (cols < GRID.cols)
    on = np.cumprod(on).astype(bool)
    above = at[on, 2] - heights[rows[on], cols[on]]
    return bool(np.any(above < 0)), float(np.min(np.abs(above), initial=np.inf)) if not np.any(above < -0.05) else 1.0


@pytest.mark.parametrize("seed", range(3))
def test_a_ray_meets_the_columns_that_a_walker_meets(seed: int) -> None:
    rng = np.random.default_rng(seed)
    heights = _columns(rng)
    columns = _over(heights)
    judged = met = 0
    for _ in range(150):
        p = np.array([*rng.uniform((101, 176), (159, 219)), rng.uniform(10.5, 26)])
        d = rng.normal(size=3) * (1, 1, rng.choice([0.1, 0.6]))
        d, length = d / np.linalg.norm(d), float(rng.choice([8.0, 500.0]))
        expected, clear = _walked(heights, p, d, length)
        if clear > 0.02:
            assert meets_column(columns, p - ORIGIN, d, length) == expected
            judged, met = judged + 1, met + expected
    assert judged > 120
    assert 20 < met < judged - 10


def test_upright_rays_meet_their_own_column() -> None:
    heights = np.full(GRID.shape, 10.0, np.float32)
    heights[10, 20] = 15.0
    columns = _over(heights)
    inside = np.array([110.25, 214.75]) - ORIGIN[:2]
    assert meets_column(columns, np.array([*inside, 4.9]), np.array([0.0, 0.0, 1.0]), 1e7)
    assert not meets_column(columns, np.array([*inside, 5.1]), np.array([0.0, 0.0, 1.0]), 1e7)
    assert meets_column(columns, np.array([*inside, 8.0]), np.array([0.0, 0.0, -1.0]), 4.0)
    assert not meets_column(columns, np.array([*inside, 8.0]), np.array([0.0, 0.0, -1.0]), 2.0)


def test_a_camera_ten_thousand_kilometres_up_sees_past_what_is_beside() -> None:
    heights = np.full(GRID.shape, 10.0, np.float32)
    heights[:, 20] = 60.0
    columns = _over(heights)
    for x, hidden in ((110.25, True), (110.6, False), (109.9, False)):
        d = np.array([300.0, 0.0, 1e7])
        d /= np.linalg.norm(d)
        assert meets_column(columns, np.array([x - ORIGIN[0], 0.1, 1.0]), d, 1e7) == hidden


def test_what_nobody_measured_hides_nothing() -> None:
    columns = _over(np.full(GRID.shape, LOWEST, np.float32))
    assert not meets_column(columns, np.array([0.1, 0.1, -50.0]), np.array([0.8, 0.0, 0.6]), 1e3)
