"""Random texture that was moved by whole pixels."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import ByteArray, Float32Array, IntArray
from cityflow.matching.sgm import SgmClock, SgmParameters, matched_block

COUNT, ROWS, COLS = 16, 60, 90
P = SgmParameters()


def texture(seed: int) -> ByteArray:
    return np.random.default_rng(seed).integers(30, 226, (ROWS, COLS + 2 * COUNT)).astype(np.uint8)


def matched(left: ByteArray, right: ByteArray, parameters: SgmParameters = P, level: int = 0) -> Float32Array:
    return matched_block(left, right, COUNT, level, parameters, SgmClock())


def moved(right: ByteArray, disparity: IntArray) -> ByteArray:
    """The left image: at column c what the right one shows at c - disparity."""
    cols = np.clip(np.arange(right.shape[1]) - disparity, 0, right.shape[1] - 1)
    return np.ascontiguousarray(right[:, cols])


@pytest.mark.parametrize("mode", ["sgbm", "3way", "hh", "hh4"])
@pytest.mark.parametrize("disparity", [0, 5, 15])
def test_every_mode_finds_a_shift_of_the_range(mode: str, disparity: int) -> None:
    """To OpenCV's sixteenth of a pixel; where the repeated end of the right image begins a few may be off."""
    right = texture(1)
    left = moved(right, np.full(right.shape[1], disparity))
    found = matched(left, right, SgmParameters.model_validate({"mode": mode}))
    assert found.shape == (ROWS, COLS)
    assert np.isfinite(found).mean() > 0.97
    assert np.nanmean(np.abs(found - disparity) <= 1 / 16) > 0.98
    assert np.nanmax(np.abs(found - disparity)) <= 1


def test_a_step_is_where_it_is_and_what_one_image_hides_is_unknown() -> None:
    """A near strip in columns 40 to 69: left of it eight columns of the left image are hidden in the right one."""
    right = texture(2)
    disparity = np.full(right.shape[1], 3)
    near = slice(COUNT + 40, COUNT + 70)
    disparity[near] = 11
    far_left = moved(right, np.full(right.shape[1], 3))
    left = far_left.copy()
    left[:, near] = moved(right, disparity)[:, near]
    # what the strip covers in the right image is not seen beside it in the left one
    hidden = slice(COUNT + 32, COUNT + 40)
    left[:, hidden] = texture(3)[:, hidden]
    found = matched(left, right)
    inside, before, behind = found[:, 42:68], found[:, :30], found[:, 72:]
    assert np.mean(np.abs(inside - 11) < 0.5) > 0.97
    assert np.mean(np.abs(before - 3) < 0.5) > 0.97
    assert np.mean(np.abs(behind - 3) < 0.5) > 0.97
    assert np.mean(np.isnan(found[:, 33:39])) > 0.5


def test_images_that_have_nothing_in_common_match_next_to_nowhere() -> None:
    found = matched(texture(4), texture(5))
    assert np.isfinite(found).mean() < 0.2


def test_small_patches_go_and_large_ones_stay() -> None:
    """A patch of 49 pixels is less than the 60 that a speckle has; one of 144 is more. What it hides in the right image is not in the left one."""
    right = texture(6)
    for edge, stays in ((7, False), (12, True)):
        left = moved(right, np.full(right.shape[1], 1))
        rows, begin = slice(20, 20 + edge), COUNT + 30
        left[rows, begin : begin + edge] = right[rows, begin - 15 : begin - 15 + edge]
        left[rows, begin - 14 : begin - 14 + edge] = texture(9)[rows, begin - 14 : begin - 14 + edge]
        patch = matched(left, right)[22 : 18 + edge, 32 : 28 + edge]
        assert (np.mean(np.abs(patch - 15) < 0.5) > 0.8) == stays
        everything = matched(left, right, SgmParameters(speckle_px=0))[22 : 18 + edge, 32 : 28 + edge]
        assert np.mean(np.abs(everything - 15) < 0.5) > 0.5


def test_the_clock_runs_only_forward() -> None:
    clock, right = SgmClock(), texture(7)
    matched_block(right, right, COUNT, 0, P, clock)
    once = clock.seconds
    matched_block(right, right, COUNT, 0, P, clock)
    assert 0 < once < clock.seconds


def test_the_same_images_give_the_same_disparities() -> None:
    left, right = texture(8), texture(8)
    np.testing.assert_array_equal(matched(left, right), matched(left.copy(), right.copy()))
