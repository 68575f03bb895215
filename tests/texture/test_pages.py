"""Patches on pages: every pixel is where the corners say, however a patch was turned."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.texture import FIRST_IMAGE, FaceFigures, Patch
from cityflow.texture.pages import corners_on_page, merged_names, pages_of, renumbered, trimmed, uvd
from cityflow.texture.placement.place import Placement, Spot

FIGURES = FaceFigures(0.1, 20.0, 3, 1, 0.0, 0.0)


def _patch(rows: int, cols: int, seed: int) -> Patch:
    rng = np.random.default_rng(seed)
    mask = rng.random((rows, cols)) < 0.8
    mask[0, 0] = mask[-1, -1] = True
    pixels = rng.integers(0, 256, (rows, cols, 3)).astype(np.uint8)
    index = np.where(mask, FIRST_IMAGE + rng.integers(0, 3, (rows, cols)), 0).astype(np.uint16)
    centres = np.argwhere(mask)[:, ::-1] + 0.5
    return Patch(
        ("solid", seed), pixels, index, mask, (np.column_stack([centres, np.full(len(centres), 7.0)]),), FIGURES
    )


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_corners_follow_their_pixels(turns: int) -> None:
    patch = _patch(5, 9, turns)
    placement = Placement((Spot(0, 3, 11, turns),), ((32, 64),))
    page = next(iter(pages_of([patch], placement)))
    corners = corners_on_page(patch.corners[0], (5, 9), placement.spots[0])
    at = np.floor(corners[:, :2]).astype(int)
    assert np.array_equal(page.pixels[at[:, 1], at[:, 0]], patch.pixels[patch.mask])
    assert np.array_equal(page.index[at[:, 1], at[:, 0]], patch.index[patch.mask])
    assert (page.owner > 0).sum() == patch.mask.sum()
    coordinates = uvd(corners, (32, 64))
    assert np.allclose(coordinates[:, 0] * 64, corners[:, 0])
    assert np.allclose((1 - coordinates[:, 1]) * 32, corners[:, 1])
    assert (coordinates[:, 2] == 7.0).all()


def test_patches_may_stand_in_the_gaps_of_others() -> None:
    ring = np.ones((6, 6), bool)
    ring[1:5, 1:5] = False
    small = np.ones((3, 3), bool)
    patches = [
        Patch(("solid", k), np.full((*m.shape, 3), 50 * (k + 1), np.uint8), np.where(m, FIRST_IMAGE + k, 0).astype(np.uint16), m, (), FIGURES)
        for k, m in enumerate((ring, small))
    ]  # fmt: skip
    page = next(iter(pages_of(patches, Placement((Spot(0, 0, 0, 0), Spot(0, 1, 1, 0)), ((8, 8),)))))
    assert (page.owner == 1).sum() == ring.sum()
    assert (page.owner == 2).sum() == 9
    assert np.array_equal(page.index == FIRST_IMAGE + 1, page.owner == 2)
    assert trimmed(page).pixels.shape == (6, 6, 3)


def test_indices_count_the_images_of_all_units() -> None:
    names = merged_names([("b", "d"), ("a", "b")])
    assert names == ("a", "b", "d")
    index = np.array([[0, 1, 2, 3]], np.uint16)
    assert renumbered(index, ("b", "d"), {n: i for i, n in enumerate(names)}).tolist() == [[0, 1, 3, 4]]
