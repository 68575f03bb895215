from __future__ import annotations

import numpy as np
import pytest

from cityflow.evaluation.statistics import error_statistics, le95, nmad, rmse
from cityflow.evaluation.terrain_accuracy import mask_scores


def test_figures_by_hand() -> None:
    d = np.array([-1.0, 0.0, 1.0, 2.0, np.nan])
    found = error_statistics(d)
    assert (found.count, found.missing, found.bias) == (4, 1, 0.5)
    assert found.rmse == pytest.approx(np.sqrt(1.5)) == rmse(d)
    assert found.nmad == pytest.approx(1.4826) == nmad(d)
    assert le95(d) == pytest.approx(1.85)


def test_nmad_is_the_standard_deviation_of_normal_noise_and_ignores_gross_errors() -> None:
    d = np.random.default_rng(0).normal(0.3, 0.05, 20_000)
    d[:500] += 40
    assert nmad(d) == pytest.approx(0.05, rel=0.06)


def test_nothing_gives_nan() -> None:
    assert np.isnan(error_statistics(np.array([np.nan])).rmse)
    assert np.isnan(nmad(np.array([])))


def test_mask_scores_by_hand() -> None:
    found, truth = np.array([1, 1, 1, 0], bool), np.array([1, 0, 0, 1], bool)
    assert mask_scores(found, truth) == pytest.approx((1 / 3, 1 / 2))
