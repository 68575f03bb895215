"""A level plain whose disparity is known: ranges hold it, blocks find it, and where a block begins changes nothing."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from cityflow.matching.lattice import PairLattice, positions
from plain_scene import BASE_M, CAMERA, DISPARITY_PX, FLIGHT_M, FOCAL_PX, lattice_of

HEIGHTS = (-1.0, 5.0)


@cache
def lattice() -> PairLattice:
    return lattice_of(heights=HEIGHTS)


def at_height(height: float) -> float:
    """Disparity against the reference plane at height 0, pixels of level 0."""
    return FOCAL_PX * BASE_M * (1 / (FLIGHT_M - height) - 1 / FLIGHT_M)


def test_blocks_cover_each_level_once() -> None:
    """The reference image looks straight down and the partner stands to its right: the lattice is the image, 240 x 320 and half of it."""
    assert lattice().coarsest == 1
    for level, shape in ((0, (240, 320)), (1, (120, 160))):
        assert lattice().shape(level) == shape
        count = np.zeros(shape, int)
        down, right = lattice().grid(level)
        for block in np.ndindex(down, right):
            top, bottom, left, end = lattice().bounds(level, (block[0], block[1]))
            count[top:bottom, left:end] += 1
        assert (count == 1).all()


@pytest.mark.parametrize("level", [0, 1])
def test_ranges_hold_all_heights_at_the_coarsest_level_and_what_was_found_below(level: int) -> None:
    low, high = lattice().range(level, (0, 1)) or (0, 0)
    assert (high - low) % 16 == 0  # whole chunks
    if level:
        assert low <= at_height(HEIGHTS[0]) / 2
        assert high > at_height(HEIGHTS[1]) / 2
    assert low < DISPARITY_PX / (1 << level) < high - 1


def test_objects_may_be_so_high_that_a_pixel_cannot_search_all_heights() -> None:
    """Up to 25 m there are 133 disparities, two thirds more than a pixel may search on the level that is the coarsest else: the ground is found as before."""
    found = lattice_of(heights=(-1.0, 25.0), most_disparities=64)
    assert (found.usual, found.coarsest) == (1, 2)
    region = found.region(0, (10, 230), (95, 310))
    assert np.isfinite(region).mean() > 0.99
    assert abs(np.nanmedian(region) - DISPARITY_PX) < 0.01


def test_beyond_all_levels_the_ground_is_searched_first() -> None:
    """Up to 33 m there are a hundred disparities even on the coarsest level, and a pixel searches 64 of them."""
    found = lattice_of(heights=(-1.0, 33.0), most_disparities=64)
    assert found.coarsest == 2
    low, high = found.range(2, (0, 0)) or (0, 0)
    assert low <= at_height(-1.0) / 4
    assert low < DISPARITY_PX / 4 < high - 1


def test_the_plain_has_one_disparity() -> None:
    """To 0.05 px where both images show it: columns from 80 on, 8 m of 0.1 m, and 10 px from the ends."""
    found = lattice().region(0, (10, 230), (95, 310))
    assert np.isfinite(found).mean() > 0.99
    assert abs(np.nanmedian(found) - DISPARITY_PX) < 0.01
    assert np.nanpercentile(np.abs(found - DISPARITY_PX), 95) < 0.05


def test_a_coarser_level_has_half_the_disparity() -> None:
    """A parabola through whole pixels, without least squares: to a third of a pixel."""
    found = lattice().region(1, (5, 115), (50, 150))
    assert np.nanpercentile(np.abs(found - DISPARITY_PX / 2), 95) < 0.33


def test_what_the_partner_does_not_show_is_unknown() -> None:
    """The partner stands 8 m to the right, so the ground under the reference image's first columns is not in it: 84 px at 38 m."""
    assert np.isnan(lattice().region(0, (20, 220), (0, 80))).all()


def test_a_region_is_cut_out_of_the_blocks_and_unknown_beyond_the_lattice() -> None:
    whole = lattice().region(0, (0, 240), (0, 320))
    part = lattice().region(0, (-10, 250), (120, 330))
    np.testing.assert_array_equal(part[10:250, :200], whole[:, 120:])
    assert np.isnan(part[:10]).all()
    assert np.isnan(part[:, 200:]).all()


def test_blocks_do_not_depend_on_what_was_asked_before() -> None:
    other = lattice_of(heights=HEIGHTS)
    alone = other.disparity(0, (1, 2))
    assert (0, (0, 0)) not in other.blocks
    np.testing.assert_array_equal(alone, lattice().region(0, (128, 240), (256, 320)))
    known = other.region(0, (0, 240), (0, 320), known_only=True)
    assert np.isnan(known[:128]).all()
    np.testing.assert_array_equal(known[128:, 256:], alone)


def test_a_dropped_block_is_matched_again_to_the_same_and_counted() -> None:
    found = lattice_of(heights=HEIGHTS)
    once = found.disparity(0, (0, 1))
    assert found.disparity(0, (0, 1)) is once
    assert found.matched[0, (0, 1)] == 1
    found.forget(0, (0, 1))
    found.forget(0, (0, 1))
    assert (0, (0, 1)) not in found.blocks
    np.testing.assert_array_equal(found.disparity(0, (0, 1)), once)
    assert found.matched[0, (0, 1)] == 2


def test_positions_are_those_of_the_middles_of_the_pixels() -> None:
    x, y = positions((2, 4, 10, 13), 2)
    assert x[0].tolist() == [42.0, 46.0, 50.0]
    assert y[:, 0].tolist() == [10.0, 14.0]
    middle = lattice().pair.reference_pixels(np.array([[CAMERA.cx]]), np.array([[CAMERA.cy]]))
    np.testing.assert_allclose(middle, [[[CAMERA.cx, CAMERA.cy]]], atol=1e-9)
