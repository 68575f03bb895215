from __future__ import annotations

import numpy as np
import pytest

from cityflow.splitting.scores.medians import lower_median, middle_of_known


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(7, 40), (8, 9, 3), (1, 5)])
def test_medians_are_those_of_what_is_known(kind: type, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(4)
    values: np.ndarray = rng.uniform(0, 255, shape).astype(kind)
    values[rng.random(shape) < 0.4] = np.nan
    values[:, 0] = np.nan
    found, some = middle_of_known(values), np.isfinite(values).any(axis=0)
    assert found.dtype == kind
    assert np.isnan(found[~some]).all()
    assert np.array_equal(found[some], np.nanmedian(values[:, some], axis=0))


def test_of_two_in_the_middle_the_lower_one_counts() -> None:
    values = np.array([[4.0, 1.0, 9.0, 2.0], [5.0, 3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])
    known = np.array([[True] * 4, [True, True, False, False], [False] * 4])
    assert np.array_equal(lower_median(values, known), [2.0, 3.0, np.nan], equal_nan=True)
