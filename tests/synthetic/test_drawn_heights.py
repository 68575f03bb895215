from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.grid import Grid
from scenes.drawn_heights import FLAT, LEAVES, HeightNoise, TrueView, matched_heights
from scenes.drawn_noise import smooth_noise

CELL = 0.1


def view(height: np.ndarray, kind: int = FLAT, dark: bool = False, contrast: float = 10.0) -> TrueView:
    grid = Grid(1000.0, 2000.0, CELL, *height.shape)
    return TrueView(
        grid, height, np.zeros(height.shape), np.full(height.shape, kind, np.uint8), np.full(height.shape, dark), np.full(height.shape, contrast, np.float32)
    )  # fmt: skip


def two_houses(gap_m: float) -> np.ndarray:
    """10 m high, level, with a gap between; ground at 0."""
    height = np.zeros((300, 300))
    width = round(gap_m / CELL)
    height[:, 50:150], height[:, 150 + width : 250] = 10.0, 10.0
    return height


def test_noise_belongs_to_cells_and_not_to_windows() -> None:
    whole = smooth_noise(Grid(1000.0, 2000.0, CELL, 200, 300), 5, 3.0)
    part = smooth_noise(Grid(1004.0, 1997.0, CELL, 50, 60), 5, 3.0)
    np.testing.assert_allclose(whole[30:80, 40:100], part, atol=1e-5)
    assert not np.allclose(whole, smooth_noise(Grid(1000.0, 2000.0, CELL, 200, 300), 6, 3.0))


@pytest.mark.parametrize("sigma", [0.0, 1.2, 8.0])
def test_noise_is_normal_and_as_smooth_as_asked(sigma: float) -> None:
    noise = smooth_noise(Grid(85000.0, 447000.0, 0.08, 800, 800), 1, sigma)
    assert noise.std() == pytest.approx(1.0, rel=0.1)
    assert abs(noise.mean()) < 0.1
    beside = np.corrcoef(noise[:, :-1].ravel(), noise[:, 1:].ravel())[0, 1]
    assert beside == pytest.approx(np.exp(-1 / (4 * sigma**2)) if sigma else 0.0, abs=0.03)


def test_a_slit_is_hardly_ever_seen_to_the_bottom_and_a_street_always() -> None:
    noise = HeightNoise(widened_cells=0, frayed=0)
    slit = matched_heights(view(two_houses(0.4)), noise, 1)[20:-20, 150:154]
    assert np.mean(np.isfinite(slit) & (slit < 1)) < 0.02
    alley = matched_heights(view(two_houses(1.4)), noise, 1)[:, 150:164]
    bottom, missing, high = np.mean(alley < 1), np.mean(np.isnan(alley)), np.mean(alley > 5)
    assert 0.05 < bottom < 0.4
    assert missing > 0.15
    assert high > 0.2
    street = matched_heights(view(two_houses(4.0)), noise, 1)[20:-20, 150:190]
    assert np.mean(street < 1) == 1.0


def test_edges_move_outwards_by_no_more_than_is_said() -> None:
    found = matched_heights(view(two_houses(4.0)), HeightNoise(widened_cells=2.0, frayed=0), 2)
    outside = (found[:, 30:50] > 5).sum(axis=1)
    assert 0 < outside.mean() < 2
    assert outside.max() == 2
    assert outside.std() > 0.2
    assert (found[:, 50:150] > 5).all()


def test_dark_places_without_texture_and_leaves_are_missing_in_part() -> None:
    flat = np.zeros((400, 400))
    noise = HeightNoise(dark_missing=0.35)
    assert np.isnan(matched_heights(view(flat, dark=True, contrast=0.1), noise, 1)).mean() == pytest.approx(
        0.35, abs=0.06
    )
    assert np.isfinite(matched_heights(view(flat, dark=True), noise, 1)).all()
    leaves = matched_heights(view(flat, LEAVES), HeightNoise(), 1)
    assert np.isnan(leaves).mean() == pytest.approx(0.3, abs=0.06)
    assert np.nanstd(leaves) > 0.3


def test_crowns_sink_in_part() -> None:
    crown = matched_heights(
        view(np.full((400, 400), 8.0), LEAVES), HeightNoise(leaf_sunk=0.5, leaf_missing=0, frayed=0), 1
    )
    assert 0.2 < np.mean(crown < 4) < 0.6  # some of it is bridged again
    assert np.nanmedian(crown[crown > 4]) == pytest.approx(8.0, abs=0.2)


def test_cells_below_a_step_are_missing_the_fewer_the_farther_off() -> None:
    found = matched_heights(view(two_houses(4.0)), HeightNoise(widened_cells=0, frayed=0.4), 3)
    missing = np.isnan(found[:, 40:50]).mean(axis=0)[::-1]
    assert missing[0] == pytest.approx(0.4, abs=0.1)
    assert missing[0] > missing[2] > 0.05
    assert (missing[3:] == 0).all()
    assert np.isfinite(found[:, 50:150]).all()


def test_creases_are_rounded_and_high_steps_are_not() -> None:
    x = np.arange(300) * CELL
    roof = np.broadcast_to(10.0 - np.abs(x - 15.0), (100, 300)).copy()
    quiet = {"level_gsd": 0.0, "widened_cells": 0.0, "frayed": 0.0}
    found = matched_heights(view(roof), HeightNoise(rounded_cells=2.0, **quiet), 1)
    assert 0.1 < (roof - found)[:, 150].mean() < 0.2
    np.testing.assert_allclose(found[:, 50:100], roof[:, 50:100], atol=1e-3)
    steep = matched_heights(view(two_houses(4.0)), HeightNoise(rounded_cells=2.0, **quiet), 1)
    np.testing.assert_allclose(steep[:, 48:52], two_houses(4.0)[:, 48:52], atol=1e-3)


def test_what_nobody_sees_stays_empty() -> None:
    height = np.full((40, 50), np.nan)
    assert np.isnan(matched_heights(view(height), HeightNoise(), 1)).all()
