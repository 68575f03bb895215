from __future__ import annotations

import numpy as np
import pytest

from cityflow.texture.linear_fit import MOST_GAIN, MOST_OFFSET, fitted

GREYS = np.array([60.0, 110.0, 160.0])


def error(gain: float, offset: float, contrast: float, outliers: float, seed: int) -> float:
    """Greatest error at usual values, in the brighter image's values over max(gain, 1)."""
    rng = np.random.default_rng(seed)
    mean = 110.0 if gain < 2 else 35.0
    truth = np.clip(rng.normal(mean, contrast / max(gain, 1), 300), 5, 250)
    x = truth + rng.normal(0, 3 / max(gain, 1), 300)
    y = gain * truth + offset + rng.normal(0, 3 * min(max(gain, 0.3), 1), 300)
    wrong = rng.random(300) < outliers
    y[wrong] = rng.uniform(0, 255, wrong.sum())
    found = fitted(x, y)
    at = GREYS / max(gain, 1)
    return float(np.abs(found[0] * at + found[1] - gain * at - offset).max())


@pytest.mark.parametrize(
    ("gain", "offset"), [(1.0, 0.0), (0.9, 8.0), (1.3, -10.0), (4.0, 0.0), (0.25, 0.0), (0.25, 5.0)]
)
@pytest.mark.parametrize(("contrast", "allowed"), [(3.0, 8.0), (15.0, 6.0), (35.0, 4.0)])
def test_gain_and_offset_are_found_among_outliers(gain: float, offset: float, contrast: float, allowed: float) -> None:
    """Where there is little contrast an offset is partly taken for a gain, which is as good near the values that there are."""
    assert max(error(gain, offset, contrast, 0.1, seed) for seed in range(8)) < allowed


def test_a_quarter_of_outliers_does_not_turn_the_line() -> None:
    assert max(error(1.0, 0.0, contrast, 0.25, seed) for contrast in (3.0, 15.0, 35.0) for seed in range(8)) < 5.0


@pytest.mark.parametrize("cells", [15, 60])
def test_what_chance_explains_is_no_difference(cells: int) -> None:
    """Values that differ by noise alone mostly stay; where values beside each other err alike there are fewer of them than it seems."""
    rng = np.random.default_rng(7)
    off, runs = [], []
    for _ in range(40):
        truth = rng.normal(110, 4, cells)
        gain, offset, _ = fitted(truth + rng.normal(0, 3, cells), truth + rng.normal(0, 3, cells))
        off.append(np.abs(gain * GREYS + offset - GREYS).max())
        alike = np.repeat(rng.normal(0, 4, -(-cells // 10)), 10)[:cells]
        gain, offset, _ = fitted(truth, truth + alike)
        runs.append(np.abs(gain * GREYS + offset - GREYS).max())
    assert np.median(off) < 1.0
    assert np.median(runs) < 2.0


def test_both_directions_give_the_same_line() -> None:
    rng = np.random.default_rng(1)
    x = rng.uniform(20, 120, 400)
    y = 1.7 * x - 12 + rng.normal(0, 4, 400)
    there, back = fitted(x, y), fitted(y, x)
    assert 1 / back[0] == pytest.approx(there[0], rel=2e-3)
    assert -back[1] / back[0] == pytest.approx(there[1], abs=0.3)
    assert back[2] == pytest.approx(there[2], rel=0.02)


def test_black_and_constant_samples_stay_within_bounds() -> None:
    for x, y in ((np.zeros(50), np.zeros(50)), (np.zeros(50), np.full(50, 200.0)), (np.full(50, 255.0), np.zeros(50))):
        gain, offset, _ = fitted(x, y)
        assert 1 / MOST_GAIN <= gain <= MOST_GAIN
        assert abs(offset) <= MOST_OFFSET
