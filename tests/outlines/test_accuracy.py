"""How exact outlines are, by façades beside them."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.building import OUTLINE_SIGMA_M
from cityflow.outlines.under_eaves.accuracy import accuracy_of

SIGMA_M = 0.03


def offsets(off_m: float, count: int = 200, seed: int = 1) -> list[tuple[float, float]]:
    """Walls that stand beside their outlines by chance, each seen with 3 cm."""
    rng = np.random.default_rng(seed)
    return [(float(t), SIGMA_M) for t in rng.normal(0, np.hypot(off_m, SIGMA_M), count)]


@pytest.mark.parametrize("off_m", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_outlines_are_off(off_m: float, seed: int) -> None:
    assert accuracy_of(offsets(off_m, seed=seed)).sigma_m == pytest.approx(off_m, rel=0.25)


def test_eaves_make_outlines_no_worse() -> None:
    """Half of the outlines are rims of roofs, their walls 0.3 to 0.7 m inside."""
    rng = np.random.default_rng(4)
    eaves = [(float(-t), SIGMA_M) for t in rng.uniform(0.3, 0.7, 200)]
    assert accuracy_of([*offsets(0.05), *eaves]).sigma_m == pytest.approx(0.05, rel=0.25)


def test_few_facades_tell_little() -> None:
    assert accuracy_of([]).sigma_m == OUTLINE_SIGMA_M
    assert np.isnan(accuracy_of([]).offset_m)
    assert accuracy_of(offsets(0.3, 2)).sigma_m < 0.25
