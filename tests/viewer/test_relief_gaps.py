from __future__ import annotations

import numpy as np
import pytest

from cityflow.viewer.relief_gaps import quiet_gaps, without_specks


def ramp(size: int = 120) -> np.ndarray:
    """Three bands that rise evenly to the right and downwards."""
    rows, cols = np.mgrid[:size, :size].astype(np.float32)
    return np.stack([rows + cols, 2 * cols, 200 - rows]).astype(np.float32)


def disc(size: int, middle: tuple[int, int], radius: float) -> np.ndarray:
    rows, cols = np.mgrid[:size, :size]
    return np.asarray(np.hypot(rows - middle[0], cols - middle[1]) <= radius)


@pytest.mark.parametrize("seed", range(3))
def test_specks_are_filled_from_around_and_the_known_stays(seed: int) -> None:
    whole, rng = ramp(), np.random.default_rng(seed)
    gaps = rng.random((120, 120)) < 0.2
    found = without_specks(np.where(gaps, np.nan, whole).astype(np.float32))
    assert np.isfinite(found).all()
    assert np.array_equal(found[:, ~gaps], whole[:, ~gaps])
    assert np.abs(found - whole)[:, gaps].max() < 6


def test_a_large_gap_stays_and_a_thin_one_goes() -> None:
    lake, crack = disc(120, (60, 40), 20), np.zeros((120, 120), bool)
    crack[:, 90:95] = True
    found = without_specks(np.where(lake | crack, np.nan, ramp()).astype(np.float32))
    assert np.isfinite(found[0][crack]).all()
    assert np.isnan(found[0][disc(120, (60, 40), 17)]).all()
    assert np.array_equal(np.isfinite(found[0]), np.isfinite(found[1]))


def test_large_gaps_are_painted_like_what_is_around() -> None:
    pixels, known = np.full((20, 20, 3), 40, np.uint8), ~disc(20, (10, 10), 5)
    painted = quiet_gaps(pixels, known)
    assert np.array_equal(painted[known], pixels[known])
    assert len(np.unique(painted[~known], axis=0)) == 1
    assert 40 < painted[10, 10].max() < 100
    assert quiet_gaps(pixels, np.ones((20, 20), bool)) is pixels


def test_a_ragged_rim_becomes_smooth() -> None:
    """Teeth between which no disc fits are filled; what lies beyond them is not."""
    known = np.zeros((120, 120), bool)
    known[:, :60] = True
    known[::6, 60:70] = True
    found = np.isfinite(without_specks(np.where(known, ramp(), np.nan).astype(np.float32))[0])
    assert found[6:114, :64].all()
    assert not found[:, 71:].any()


def test_nothing_known_and_nothing_missing_stay_as_they_are() -> None:
    assert np.isnan(without_specks(np.full((1, 40, 40), np.nan, np.float32))).all()
    whole = ramp(40)
    assert without_specks(whole) is whole
