"""A block on level ground, its surface spoilt in known ways."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.evaluation.dsm import dsm_figures, zones

CELL = 0.1


def block() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """10 m of ground with a roof of 4 m in the middle, 5 m high, and a crown in a corner."""
    truth = np.zeros((100, 100))
    truth[30:70, 30:70] = 5.0
    truth[85:95, 85:95] = 4.0
    roof = truth == 5
    return truth, truth != 4, roof


def test_perfect_surface() -> None:
    truth, solid, roof = block()
    found = dsm_figures(truth, truth, solid, roof, CELL)
    assert (found.within, found.completeness, found.rim, found.rim_completeness) == (1, 1, 1, 1)
    assert found.nmad == found.bias == found.rmse == 0


def test_zones_keep_two_cells_from_steps_and_one_metre_of_rim() -> None:
    truth, solid, roof = block()
    inner, rim = zones(truth, solid, roof, CELL)
    # the step lies between columns 29 and 30: cells 28 to 31 are within two cells of it
    assert inner[50, 26:35].tolist() == [True, True, False, False, False, False, True, True, True]
    assert not rim[50, 18]
    assert rim[50, 19:41].all()
    assert not rim[50, 41]
    assert not rim[82:, 82:].any(), "a crown is no roof"
    assert not inner[90, 90], "nor ground"


def test_rim_and_inner_figures_are_of_their_own_cells() -> None:
    truth, solid, roof = block()
    wide = truth.copy()
    wide[27:73, 27:73] = 5.0  # three cells too wide
    found = dsm_figures(wide, truth, solid, roof, CELL)
    _, rim = zones(truth, solid, roof, CELL)
    assert found.rim == pytest.approx(1 - (46**2 - 40**2) / rim.sum())
    inner, _ = zones(truth, solid, roof, CELL)
    assert found.within == pytest.approx(1 - (46**2 - 44**2) / inner.sum(), abs=2e-3), "one ring lies clear of the step"


def test_noise_bias_and_holes() -> None:
    truth, solid, roof = block()
    rng = np.random.default_rng(1)
    dsm = truth + rng.normal(0.05, 0.02, truth.shape)
    dsm[:10] = np.nan
    found = dsm_figures(dsm, truth, solid, roof, CELL)
    assert found.bias == pytest.approx(0.05, abs=0.002)
    assert found.nmad == pytest.approx(0.02, rel=0.05)
    assert found.rmse == pytest.approx(np.hypot(0.05, 0.02), rel=0.05)
    inner, _ = zones(truth, solid, roof, CELL)
    assert found.completeness == pytest.approx(1 - 1000 / inner.sum())
