from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.points import PointCloud
from cityflow.surface.evenness import NEIGHBOURS, unevenness
from cityflow.surface.vegetation import is_foliage


def gable(density: float, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) points on a roof of 10 x 8 m and 40 degrees, 2.5 cm of noise in each direction, and on its eaves' walls."""
    xy = rng.uniform(0, (10, 8), (int(80 * density), 2))
    roof = np.column_stack([xy, 8 - 0.84 * np.abs(xy[:, 1] - 4)])
    wall = np.column_stack(
        [rng.uniform(0, 10, int(5 * density)), np.zeros(int(5 * density)), rng.uniform(0, 4.6, int(5 * density))]
    )
    return np.concatenate([roof, wall]) + rng.normal(0, 0.025, (len(roof) + len(wall), 3))


def crown(density: float, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) points in a crown of 8 m."""
    xy = rng.uniform(-4, 4, (int(64 * density), 2))
    xy = xy[np.hypot(*xy.T) < 3.9]
    return np.column_stack([xy, 6 + np.sqrt(16 - (xy**2).sum(axis=1)) - rng.exponential(0.8, len(xy))])


@pytest.mark.parametrize("density", [3, 8, 25])
def test_roofs_are_even_and_crowns_are_not_at_any_density(density: int) -> None:
    rng = np.random.default_rng(density)
    assert (unevenness(gable(density, rng)) < 0.2).mean() > 0.97
    assert (unevenness(crown(density, rng)) > 0.2).mean() > 0.85


def test_too_few_points_say_nothing_and_a_line_is_no_patch() -> None:
    flat = np.random.default_rng(1).uniform(0, 5, (NEIGHBOURS - 1, 3)) * [1, 1, 0]
    assert (unevenness(flat) == 1).all()
    assert (unevenness(np.zeros((40, 3))) == 1).all()


def test_a_pulse_that_goes_on_wants_more_evenness() -> None:
    rng = np.random.default_rng(5)
    xyz = np.column_stack([rng.uniform(0, 6, (400, 2)), rng.normal(0, 0.045, 400)])
    ones = np.ones(400, np.uint8)
    single, split = (PointCloud(xyz, 0 * ones, ones, n * ones) for n in (np.uint8(1), np.uint8(2)))
    assert is_foliage(single, 0.2).mean() < 0.3 < 0.6 < is_foliage(split, 0.2).mean()
