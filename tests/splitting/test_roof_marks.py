from __future__ import annotations

import numpy as np
import pytest

from cityflow.splitting.roof_marks import roof_marks

CELL = 0.2
U = np.arange(0.0, 30.0, CELL) + CELL / 2
DEPTH = 30


def _rows(profile: np.ndarray, seed: int, noise_m: float = 0.05) -> np.ndarray:
    """The same profile along the row in every part of the depth, with noise and holes, as points give it."""
    g = np.random.default_rng(seed)
    rows = profile[:, None] + g.normal(0, noise_m, (len(U), DEPTH))
    rows[g.random(rows.shape) < 0.05] = np.nan
    return rows


def _gables(width: float, slope: float) -> np.ndarray:
    """Gable roofs side by side, a valley at every multiple of the width."""
    return 6.0 + slope * (width / 2 - np.abs((U % width) - width / 2))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("width", "slope"), [(6.0, 0.8), (7.5, 0.6), (5.0, 1.2)])
def test_valleys_between_gables_are_found_where_they_are(width: float, slope: float, seed: int) -> None:
    rows = _rows(_gables(width, slope), seed)
    true = np.arange(width, 29.0 - 2.2, width)
    for place in true:
        near = roof_marks(rows, U, np.array([place - 0.3, place, place + 0.3]))
        assert near.valley[1] > 0.6
        assert near.bottom[near.valley > 0] == pytest.approx(place, abs=0.05)
    ridges = roof_marks(rows, U, true - width / 2)
    assert ridges.strength.max() == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_sharp_steps_along_the_depth(seed: int) -> None:
    level = np.where(U > 12.0, 8.9, 8.2) + np.where(U > 20.0, 0.35, 0.0)
    marks = roof_marks(_rows(level, seed), U, np.array([12.0, 16.0, 20.0]))
    assert marks.step[0] == 1.0
    assert marks.step_m[0] == pytest.approx(0.7, abs=0.05)
    assert marks.step[1] == 0.0
    assert marks.valley.max() == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_roofs_without_borders_have_no_marks(seed: int) -> None:
    places = np.arange(3.0, 27.0, 0.4)
    sloped = 5.0 + 0.7 * U
    ridge = 9.0 - 0.8 * np.abs(U - 15.0)
    soft_step = 8.0 + 1.0 / (1 + np.exp(-(U - 15.0) / 0.8))
    for profile in (np.full(len(U), 8.0), sloped, ridge, soft_step):
        assert roof_marks(_rows(profile, seed), U, places).strength.max() < 0.2


def test_dormers_and_annexes_do_not_make_a_border() -> None:
    rows = _rows(np.full(len(U), 8.0), 1)
    rows[np.ix_((U > 10) & (U < 12), np.arange(8))] += 1.2
    assert roof_marks(rows, U, np.array([10.0, 12.0])).strength.max() < 0.1
    # what is low behind the house takes no part in what its roof shows
    gables = _rows(_gables(6.0, 0.8), 2)
    gables[:, 18:] = 3.0
    assert roof_marks(gables, U, np.array([12.0])).valley[0] > 0.6


def test_nothing_known() -> None:
    for rows in (np.full((len(U), 5), np.nan), np.zeros((len(U), 2)), np.zeros((4, 9))):
        marks = roof_marks(rows, U[: len(rows)], np.array([3.0, 9.0]))
        assert marks.strength.tolist() == [0.0, 0.0]
        assert np.isnan(marks.bottom).all()
