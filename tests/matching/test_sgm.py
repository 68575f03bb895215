"""Random texture that was moved by whole pixels."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import ByteArray, Float32Array, IntArray
from cityflow.matching.disparity_search import Search, Sight, search_everywhere
from cityflow.matching.sgm import SgmClock, SgmParameters, matched_block

COUNT, ROWS, COLS = 16, 60, 90
P = SgmParameters()
EVERYTHING = search_everywhere((0, COUNT))


def texture(seed: int) -> ByteArray:
    return np.random.default_rng(seed).integers(30, 226, (ROWS, COLS + 2 * COUNT)).astype(np.uint8)


def matched(left: ByteArray, right: ByteArray, parameters: SgmParameters = P) -> Float32Array:
    """Disparities 0 to 15 of the columns that have all of them in the right image."""
    reference = np.ascontiguousarray(left[:, COUNT : COUNT + COLS])
    return matched_block(reference, right, EVERYTHING, sight_of(right), 0, parameters, SgmClock())


def sight_of(right: ByteArray, first: int = -COUNT) -> Sight:
    """Both images show all; the right image's first column is that of disparity 16 of the first pixel."""
    return Sight(np.ones((ROWS, COLS), bool), np.ones(right.shape, bool), first)


def moved(right: ByteArray, disparity: IntArray) -> ByteArray:
    """The left image: at column c what the right one shows at c - disparity."""
    cols = np.clip(np.arange(right.shape[1]) - disparity, 0, right.shape[1] - 1)
    return np.ascontiguousarray(right[:, cols])


@pytest.mark.parametrize("eight_paths", [False, True])
@pytest.mark.parametrize("disparity", [0, 5, 15])
def test_a_shift_of_the_range_is_found(eight_paths: bool, disparity: int) -> None:
    """To a quarter of a pixel, before least squares; where the repeated end of the right image begins a few may be off."""
    right = texture(1)
    left = moved(right, np.full(right.shape[1], disparity))
    found = matched(left, right, SgmParameters(eight_paths=eight_paths))
    assert found.shape == (ROWS, COLS)
    assert np.isfinite(found).mean() > 0.97
    assert np.nanmean(np.abs(found - disparity) <= 0.25) > 0.97
    assert np.nanmax(np.abs(found - disparity)) <= 1


def test_pixels_with_ranges_of_their_own_find_what_lies_in_them() -> None:
    """Rows of disparity 3 and 40: each searches ten disparities around its own, in a third of the range; a row that searches elsewhere finds nothing."""
    right = np.random.default_rng(11).integers(30, 226, (ROWS, COLS + 80)).astype(np.uint8)
    truth = np.where(np.arange(ROWS) < 30, 3, 40)
    left = np.stack([right[i, 60 - d : 60 - d + COLS] for i, d in enumerate(truth)])
    low = np.repeat(truth[:, None] - 5, COLS, axis=1).astype(np.int32)
    low[:5] += 30
    search = Search(low, low + 9)
    low_hull, high_hull = search.hull() or (0, 0)
    assert low_hull <= -2 < 45 <= high_hull
    assert low_hull % 16 == 1
    assert high_hull % 16 == 1
    partner = np.pad(right, ((0, 0), (20, 20)))[:, 80 - high_hull + 1 :]
    found = matched_block(
        np.ascontiguousarray(left),
        np.ascontiguousarray(partner),
        search,
        sight_of(partner, 1 - high_hull),
        0,
        P,
        SgmClock(),
    )
    assert np.mean(np.abs(found[8:28] - 3) < 0.5) > 0.97
    assert np.mean(np.abs(found[33:] - 40) < 0.5) > 0.97
    assert np.isfinite(found[:4]).mean() < 0.3
    assert search.chunks(sight_of(partner, 1 - high_hull)).start[-1] <= 2 * ROWS * COLS


def test_pixels_that_are_not_seen_are_not_searched() -> None:
    right = texture(12)
    left = moved(right, np.full(right.shape[1], 4))
    seen = np.ones((ROWS, COLS), bool)
    seen[:, 30:50] = False
    seen[20:25] = False
    reference = np.ascontiguousarray(left[:, COUNT : COUNT + COLS])
    found = matched_block(reference, right, EVERYTHING, sight_of(right)._replace(reference=seen), 0, P, SgmClock())
    assert np.isnan(found[~seen]).all()
    assert np.mean(np.abs(found[seen] - 4) < 0.5) > 0.95
    assert EVERYTHING.chunks(sight_of(right)._replace(reference=seen)).start[-1] == 2 * int(seen.sum())


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
    """A patch of 144 pixels is less than the 150 that a speckle has here; one of 400 is more, even without its rim.

    What it hides in the right image is not in the left one.
    """
    right = texture(6)
    for edge, stays in ((12, False), (20, True)):
        left = moved(right, np.full(right.shape[1], 1))
        rows, begin = slice(20, 20 + edge), COUNT + 30
        left[rows, begin : begin + edge] = right[rows, begin - 15 : begin - 15 + edge]
        left[rows, begin - 14 : begin - 14 + edge] = texture(9)[rows, begin - 14 : begin - 14 + edge]
        patch = matched(left, right, SgmParameters(speckle_px=150))[23 : 17 + edge, 33 : 27 + edge]
        assert (np.mean(np.abs(patch - 15) < 0.5) > 0.7) == stays
        everything = matched(left, right, SgmParameters(speckle_px=0))[23 : 17 + edge, 33 : 27 + edge]
        assert np.mean(np.abs(everything - 15) < 0.5) > 0.5


def test_large_disparities_are_found_like_small_ones() -> None:
    """Far from the reference plane of a large image; 2,048 is beyond 16 bits when counted in sixteenths."""
    right = texture(13)
    disparity = np.where(np.arange(right.shape[1]) < COUNT + COLS // 2, 15, 16)
    near, far = 32, 2032 + 32
    found = {}
    for end in (near, far):
        partner = np.pad(right, ((0, 0), (COUNT, 0)), mode="edge")
        everything = search_everywhere((end - 32, end))
        reference = np.ascontiguousarray(moved(right, disparity)[:, COUNT : COUNT + COLS])
        found[end] = matched_block(reference, partner, everything, sight_of(partner, -end), 0, P, SgmClock())
    assert np.isfinite(found[near]).mean() > 0.8
    np.testing.assert_allclose(found[far] - 2032, found[near], atol=1e-3)


def test_the_clock_runs_only_forward() -> None:
    clock, right = SgmClock(), texture(7)
    matched_block(right[:, :COLS], right, EVERYTHING, sight_of(right), 0, P, clock)
    once = clock.seconds
    matched_block(right[:, :COLS], right, EVERYTHING, sight_of(right), 0, P, clock)
    assert 0 < once < clock.seconds


def test_the_same_images_give_the_same_disparities() -> None:
    left, right = texture(8), texture(8)
    np.testing.assert_array_equal(matched(left, right), matched(left.copy(), right.copy()))
