"""Windows of a reference image, dealt to two ground tiles: each tile has all pixels that it was given, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import BoolArray
from cityflow.core.pixels import ArrayPixels
from cityflow.matching.tile_depths import Merged, TileDepths

COLOUR = np.arange(1, 20 * 30 * 3 + 1, dtype=np.uint16).reshape(20, 30, 3)


def window(row: int, col: int) -> Merged:
    """8 x 10 pixels, whose depth tells their row and column."""
    i, j = np.mgrid[row : row + 8, col : col + 10]
    depth = (100 * i + j).astype(np.float32)
    return Merged(row, col, depth, (0.25 + depth / 4096).astype(np.float32), (1 + (i + j) % 5).astype(np.uint8))


def where(**of: slice) -> BoolArray:
    kept = np.zeros((8, 10), bool)
    kept[of["rows"], of["cols"]] = True
    return kept


@pytest.fixture
def dealt() -> TileDepths:
    """The left half of the first window and one pixel of the second for `west`, the right half of the first for `east`."""
    found = TileDepths("image", ArrayPixels(COLOUR))
    found.add("west", window(2, 4), where(rows=slice(1, 7), cols=slice(0, 5)))
    found.add("east", window(2, 4), where(rows=slice(0, 8), cols=slice(5, 10)))
    found.add("west", window(10, 4), where(rows=slice(4, 5), cols=slice(7, 8)))
    found.add("west", window(10, 14), np.zeros((8, 10), bool))
    return found


def test_points_are_counted_by_tile(dealt: TileDepths) -> None:
    assert dealt.points == {"west": 6 * 5 + 1, "east": 8 * 5}


def test_a_tile_reaches_from_its_first_to_its_last_pixel(dealt: TileDepths) -> None:
    west = dealt.take("west")
    assert west is not None
    assert (west.image, west.row, west.col, west.depth.shape) == ("image", 3, 4, (12, 8))
    known = np.isfinite(west.depth)
    assert known.sum() == 31
    i, j = np.nonzero(known)
    np.testing.assert_array_equal(west.depth[known], 100 * (i + west.row) + j + west.col)
    assert known[11, 7]
    assert known[:6, :5].all()
    np.testing.assert_array_equal(west.views[known], 1 + (i + west.row + j + west.col) % 5)
    assert not west.views[~known].any()
    assert np.isnan(west.sigma[~known]).all()
    np.testing.assert_array_equal(west.sigma[known], (0.25 + west.depth[known] / 4096).astype(np.float16))


def test_colours_are_those_of_the_pixels_with_a_depth(dealt: TileDepths) -> None:
    east = dealt.take("east")
    assert east is not None
    np.testing.assert_array_equal(east.colour, COLOUR[2:10, 9:14])
    west = dealt.take("west")
    assert west is not None
    known = np.isfinite(west.depth)
    np.testing.assert_array_equal(west.colour[known], COLOUR[3:15, 4:12][known])
    assert not west.colour[~known].any()


def test_what_was_taken_is_gone_and_a_tile_without_points_has_no_map(dealt: TileDepths) -> None:
    assert dealt.take("north") is None
    assert dealt.take("east") is not None
    assert dealt.take("east") is None
