"""Narrow holes below the terrain are found; ground between crowns, quarries and slopes are none."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.surface.pits import pits

CELL = 0.5


def hill(seed: int, slope: float = 0.15) -> np.ndarray:
    y, x = np.mgrid[:240, :260] * CELL
    noise = np.random.default_rng(seed).normal(0, 0.05, x.shape)
    return np.asarray(60 + slope * x - 0.05 * y + 2 * np.sin(x / 40) + noise)


@pytest.mark.parametrize("seed", range(3))
def test_deep_narrow_holes_are_found_and_nothing_else(seed: int) -> None:
    ground = hill(seed)
    dsm, true = ground.copy(), np.zeros(ground.shape, bool)
    rng = np.random.default_rng(seed + 100)
    for _ in range(6):
        r, c = rng.integers(10, 220, 2)
        true[r : r + 8, c : c + 12] = True
    dsm[true] -= 9.0
    terrain = np.where(true, ground - 6.0, ground)
    assert np.array_equal(pits(dsm, terrain, CELL), true)


def test_ground_between_crowns_is_no_hole() -> None:
    ground = hill(7)
    crowns = np.random.default_rng(1).random(ground.shape) < 0.9
    dsm = np.where(crowns, ground + 18.0, ground)
    assert not pits(dsm, ground, CELL).any()


def test_a_wide_quarry_stays() -> None:
    ground = hill(3)
    ground[60:140, 60:150] -= 8.0
    assert not pits(ground, ground, CELL).any()


def test_beyond_the_survey_nothing_is_found() -> None:
    ground = hill(5)
    ground[:, 100:] = np.nan
    dsm = ground.copy()
    dsm[50:56, 20:26] -= 10
    found = pits(dsm, ground, CELL)
    assert found[50:56, 20:26].all()
    assert found.sum() == 36
