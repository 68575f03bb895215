"""Waves that were shifted by known parts of a pixel."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import Float32Array
from cityflow.matching.subpixel import MOST_SHIFT_PX, SubpixelParameters, refined
from plain_scene import grey

ROWS, COLS = 60, 120
P = SubpixelParameters(steps=2)


def row_and_col() -> tuple[np.ndarray, np.ndarray]:
    row, col = np.mgrid[:ROWS, :COLS].astype(np.float64)
    return row, col


def inner(values: Float32Array) -> Float32Array:
    """Where windows are whole and the partner shows what they ask for."""
    return values[10:-10, 20:-20]


def error_px(shift: float, start: Float32Array, parameters: SubpixelParameters = P, gain: float = 1.0) -> Float32Array:
    """Base at column c is partner at column c - shift."""
    row, col = row_and_col()
    partner = np.rint(gain * grey(col + shift, row)).astype(np.uint8)
    return inner(refined(grey(col, row), partner, start, 0, parameters)) - np.float32(shift)


@pytest.mark.parametrize("shift", [-3.5, 0.0, 0.25, 4.4, 7.9])
def test_parts_of_a_pixel_are_found(shift: float) -> None:
    """From whole pixels, the rounded disparity; to 0.01 px, where semi-global matching scatters by 0.25. Where waves cancel out it is damped."""
    error = error_px(shift, np.full((ROWS, COLS), np.rint(shift), np.float32))
    assert error.std() < 0.01
    assert np.abs(error).max() < 0.05


def test_scattered_disparities_come_nearer_to_the_truth() -> None:
    start = (4.4 + np.random.default_rng(1).normal(0.0, 0.25, (ROWS, COLS))).astype(np.float32)
    error = error_px(4.4, start)
    assert error.std() < 0.04
    assert abs(error.mean()) < 0.01


def test_another_brightness_of_the_partner_does_not_matter() -> None:
    row, col = row_and_col()
    partner = grey(col + 4.4, row) // 2 + 60
    reference = grey(col, row) // 2 + 20
    found = inner(refined(reference, partner, np.full((ROWS, COLS), 4.0, np.float32), 0, P))
    assert (found - 4.4).std() < 0.02  # half the contrast: twice the rounding, four times the damping


def test_a_slanted_surface_keeps_its_slant() -> None:
    """One pixel of disparity in ten columns: neither averaging nor windows make a staircase of it."""
    row, col = row_and_col()
    truth = (2.0 + 0.1 * col).astype(np.float32)
    start = truth + np.random.default_rng(1).normal(0.0, 0.25, truth.shape).astype(np.float32)
    error = inner(refined(grey(col, row), grey((col + 2.0) / 0.9, row), start, 0, P) - truth)
    assert error.std() < 0.06
    assert abs(error.mean()) < 0.01
    assert abs(np.polyfit(np.arange(80), error.mean(axis=0), 1)[0]) < 0.001


def test_a_step_is_left_where_it_is() -> None:
    """Beside a step no window lies on one surface, so nothing is solved for, and the averages are of one side."""
    row, col = row_and_col()
    start = np.where(col < 60, 4.0, 12.0).astype(np.float32)
    found = refined(grey(col, row), grey(col + 4.3, row), start, 0, P)
    np.testing.assert_array_equal(found[:, 56:64], start[:, 56:64])
    assert (found[10:-10, 20:44] - 4.3).std() < 0.02


def test_without_texture_disparities_stay() -> None:
    flat = np.full((ROWS, COLS), 90, np.uint8)
    start = np.full((ROWS, COLS), 5.25, np.float32)
    np.testing.assert_allclose(refined(flat, flat, start, 0, P), start, atol=1e-6)


def test_corrections_are_bounded() -> None:
    start = np.full((ROWS, COLS), 2.0, np.float32)
    assert np.abs(error_px(4.4, start) + 2.4).max() <= MOST_SHIFT_PX + 1e-6


def test_what_is_unknown_stays_unknown_and_no_steps_change_nothing() -> None:
    row, col = row_and_col()
    start = np.full((ROWS, COLS), 4.0, np.float32)
    start[20:30, 40:60] = np.nan
    reference, partner = grey(col, row), grey(col + 4.4, row)
    np.testing.assert_array_equal(np.isnan(refined(reference, partner, start, 0, P)), np.isnan(start))
    np.testing.assert_array_equal(refined(reference, partner, start, 0, SubpixelParameters(steps=0)), start)
