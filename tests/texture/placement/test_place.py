"""Pixel sets on pages: none may ever meet, whatever their shape, number and page."""

from __future__ import annotations

import time

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.texture.placement.place import PatchEmpty, PatchTooLarge, Placement, PlacementParameters, Spot, place

SMALL = PlacementParameters(page_px=256, first_px=16, effort=0.0)


def painted(masks: list[BoolArray], placement: Placement) -> list[IntArray]:
    """Pages with how many patches each pixel has; each patch must lie on its page as a whole."""
    pages = [np.zeros(shape, np.int64) for shape in placement.pages]
    assert len(placement.spots) == len(masks)
    for mask, spot in zip(masks, placement.spots, strict=True):
        turned = np.rot90(mask, spot.quarter_turns)
        assert spot.row >= 0
        assert spot.col >= 0
        window = pages[spot.page][spot.row : spot.row + turned.shape[0], spot.col : spot.col + turned.shape[1]]
        assert window.shape == turned.shape
        window += turned
    return pages


def placed(masks: list[BoolArray], parameters: PlacementParameters = SMALL) -> Placement:
    """A placement without a pixel of two patches, on pages of powers of two."""
    placement = place(masks, parameters)
    pages = painted(masks, placement)
    for page in pages:
        assert page.max() == 1
        assert all(parameters.first_px <= edge <= parameters.page_px and edge & (edge - 1) == 0 for edge in page.shape)
    assert sum(int(page.sum()) for page in pages) == sum(int(mask.sum()) for mask in masks)
    return placement


def efficiency(masks: list[BoolArray], placement: Placement) -> float:
    pages = painted(masks, placement)
    tight = [(np.flatnonzero(p.any(axis=1))[-1] + 1) * (np.flatnonzero(p.any(axis=0))[-1] + 1) for p in pages]
    return float(sum(int(p.sum()) for p in pages) / sum(tight))


def drawn_walls(count: int, seed: int, longest: float = 90.0) -> list[BoolArray]:
    """Sheared quadrilaterals, slivers and L shapes, sizes spread over an order of magnitude."""
    rng = np.random.default_rng(seed)
    masks = []
    for number in range(count):
        a, b = np.exp(rng.uniform(np.log(4.0), np.log(longest), 2))
        angle, shear = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-0.8, 0.8)
        corners = np.array(
            [[0, 0], [a, 0], [a, b], [0, b]]
            if number % 4
            else [[0, 0], [a, 0], [a, b / 3], [a / 3, b / 3], [a / 3, b], [0, b]]
        )
        corners = corners @ np.array([[1.0, 0.0], [shear, 1.0]])
        corners = corners @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        corners = np.round(corners - corners.min(axis=0)).astype(np.int32) + 2
        mask = np.zeros(corners.max(axis=0)[::-1] + 3, np.uint8)
        cv2.fillPoly(mask, [corners], 1)
        masks.append(cv2.dilate(mask, np.ones((5, 5), np.uint8)) > 0)
    return masks


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([0.2, 0.5, 0.9]))
@settings(max_examples=25, deadline=None)
def test_that_no_pixel_belongs_to_two_patches(seed: int, count: int, share: float) -> None:
    """Any sets of pixels: scattered, with holes, of several parts, with empty rims."""
    rng = np.random.default_rng(seed)
    masks = []
    for rows, cols in rng.integers(1, 40, (count, 2)).tolist():
        mask = rng.random((rows, cols)) < share
        mask[rng.integers(rows), rng.integers(cols)] = True
        masks.append(mask)
    placed(masks)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_that_walls_of_all_sizes_take_most_of_the_rectangle(seed: int) -> None:
    masks = drawn_walls(250, seed)
    placement = placed(masks, PlacementParameters())
    assert len(placement.pages) == 1
    assert efficiency(masks, placement) >= 0.80


def test_that_no_patches_need_no_page() -> None:
    assert place([]) == Placement((), ())


def test_that_a_set_without_pixels_is_named() -> None:
    with pytest.raises(PatchEmpty, match="patch 1"):
        place([np.ones((3, 3), bool), np.zeros((4, 5), bool)])
    with pytest.raises(PatchEmpty, match="patch 0"):
        place([np.zeros((0, 5), bool)])


def test_that_a_patch_beyond_the_page_is_named() -> None:
    with pytest.raises(PatchTooLarge, match=r"patch 1.*3 × 300"):
        place([np.ones((3, 3), bool), np.ones((3, 300), bool)], SMALL)


def test_that_single_pixels_stand_close() -> None:
    masks = [np.ones((1, 1), bool)] * 256
    assert placed(masks).pages == ((16, 16),)


def test_that_a_page_is_filled_to_the_last_pixel() -> None:
    masks = [np.ones((64, 64), bool)] * 16
    assert placed(masks).pages == ((256, 256),)


def test_four_hundred_equal_rectangles() -> None:
    masks = [np.ones((20, 30), bool)] * 400
    placement = placed(masks, PlacementParameters())
    assert efficiency(masks, placement) >= 0.93


def test_that_what_a_page_cannot_hold_goes_to_the_next() -> None:
    masks = [np.ones((100, 100), bool)] * 11 + drawn_walls(40, 3, 40.0)
    placement = placed(masks)
    assert len(placement.pages) > 2
    assert {spot.page for spot in placement.spots} == set(range(len(placement.pages)))
    assert all(page == (256, 256) for page in placement.pages[:2])


def test_a_wall_of_eight_thousand_pixels() -> None:
    masks = [np.ones((8000, 40), bool), np.ones((40, 8000), bool), *drawn_walls(60, 8)]
    placement = placed(masks, PlacementParameters())
    assert sorted(placement.pages[0])[1] == 8192
    assert sorted(placement.pages[0])[0] <= 256


def test_that_shapes_stand_in_the_holes_of_others() -> None:
    """A bar in the mouth of each C leaves nothing free."""
    frame = np.ones((32, 32), bool)
    frame[8:24, 8:] = False
    masks = [frame, frame, np.ones((16, 24), bool), np.ones((24, 16), bool)]
    assert efficiency(masks, placed(masks)) == 1.0


def test_that_turns_are_lossless_quarters() -> None:
    """A tall page is full only if the flat one is turned."""
    masks = [np.ones((16, 8), bool), np.ones((8, 16), bool), np.ones((16, 8), bool), np.ones((8, 16), bool)]
    placement = placed(masks, PlacementParameters(page_px=256, first_px=8))
    assert placement.pages[0][0] * placement.pages[0][1] == 512


def test_that_an_empty_rim_may_be_another_patchs_room() -> None:
    loose = np.zeros((40, 40), bool)
    loose[18:22, 18:22] = True
    placed([loose] * 5 + drawn_walls(20, 4, 20.0))


def test_that_parameters_are_checked() -> None:
    with pytest.raises(ValueError, match="power of two"):
        PlacementParameters(page_px=3000)
    with pytest.raises(ValueError, match="beyond page_px"):
        PlacementParameters(page_px=256, first_px=512)


def test_that_spots_compare_and_hash() -> None:
    assert Spot(0, 1, 2, 3) in {Spot(0, 1, 2, 3)}


def test_that_six_hundred_patches_take_seconds() -> None:
    masks = drawn_walls(600, 9)
    placed(masks[:5])
    start = time.process_time()
    placed(masks, PlacementParameters(effort=0.0))
    assert time.process_time() - start < 5.0
