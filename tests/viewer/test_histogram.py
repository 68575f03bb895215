from __future__ import annotations

import numpy as np
import pytest

from cityflow.viewer.histogram import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Histogram, histogram


def counts(drawn: Histogram) -> list[int]:
    return [int(b.label.rsplit(": ", 1)[1]) for b in drawn.bars]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize("scale", [0.01, 1.0, 300.0])
def test_every_value_is_in_one_bar_and_bars_stay_in_the_drawing(seed: int, whole: bool, scale: float) -> None:
    rng = np.random.default_rng(seed)
    values = scale * rng.lognormal(0, 1, 500)
    values = np.ceil(values) if whole else values
    drawn = histogram("t", "a", values.tolist(), whole=whole)
    assert sum(counts(drawn)) == 500
    assert len(drawn.bars) <= 25
    for bar in drawn.bars:
        assert bar.x >= LEFT
        assert bar.x + bar.width <= WIDTH - RIGHT + 1e-6
        assert bar.y >= TOP - 1e-6
        assert bar.y + bar.height == pytest.approx(HEIGHT - BOTTOM)


def test_whole_numbers_have_a_bar_each() -> None:
    drawn = histogram("t", "planes", [1, 1, 1, 2, 4], whole=True)
    assert [b.label for b in drawn.bars] == ["1: 3", "2: 1", "4: 1"]


@pytest.mark.parametrize("values", [[0.0], [5.0], [3.0, 3.0, 3.0], [0.0, 1e-6], [1e6]])
def test_one_value_is_enough(values: list[float]) -> None:
    assert sum(counts(histogram("t", "a", values))) == len(values)


def test_no_values_no_bars() -> None:
    assert histogram("t", "a", []).bars == ()


def test_heights_are_in_proportion() -> None:
    drawn = histogram("t", "a", [1, 1, 1, 1, 2, 2], whole=True)
    assert drawn.bars[0].height == pytest.approx(2 * drawn.bars[1].height)
