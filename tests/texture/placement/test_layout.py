"""The map of free pixels finds the spots that a search of every pixel finds."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.texture.placement.availability import NONE, SQUARES, nothing_taken, occupy, square_column
from cityflow.texture.placement.layout import NOWHERE, Bounds, filled
from cityflow.texture.placement.pixel_runs import TURNS, patches_of


def blobs(count: int, seed: int, largest: int) -> list[BoolArray]:
    """Rectangles with corners cut off, some with holes, some of scattered pixels."""
    rng = np.random.default_rng(seed)
    masks = []
    for rows, cols in rng.integers(1, largest, (count, 2)).tolist():
        r, c = np.mgrid[:rows, :cols]
        mask = (r + c >= rng.integers(0, 4)) & (r - c < rows - rng.integers(0, 4))
        if rng.random() < 0.3:
            mask &= rng.random((rows, cols)) < 0.7
        mask[rng.integers(rows), rng.integers(cols)] = True
        masks.append(mask)
    return masks


def searched(masks: list[BoolArray], width: int, rows: int) -> IntArray:
    """Every row, every column, every turn: the lowest foot and middle, the first column, the first turn."""
    taken = np.zeros((rows, width), bool)
    spots = np.full((len(masks), 3), NOWHERE)
    for number, mask in enumerate(masks):
        best = np.inf
        for turn in range(TURNS):
            turned = np.rot90(mask, turn)
            height, wide = turned.shape
            reach = 0.5 * (height + np.nonzero(turned)[0].mean())
            for row, col in np.ndindex(max(rows - height + 1, 0), max(width - wide + 1, 0)):
                if not (taken[row : row + height, col : col + wide] & turned).any():
                    if row + reach < best - 1e-9:
                        best, spots[number] = row + reach, (row, col, turn)
                    break
        if np.isfinite(best):
            row, col, turn = spots[number]
            turned = np.rot90(mask, turn)
            taken[row : row + turned.shape[0], col : col + turned.shape[1]] |= turned
    return spots


@pytest.mark.parametrize("seed", range(3))
def test_that_no_earlier_spot_is_overlooked(seed: int) -> None:
    masks = sorted(blobs(40, seed, 22), key=lambda m: -int(m.sum()))
    found = filled(patches_of(masks), np.arange(len(masks)), Bounds(61, 8, 96))
    np.testing.assert_array_equal(found, searched(masks, 61, 96))
    assert (found[:, 0] >= 0).sum() > 20


def test_that_runs_are_those_of_the_turned_mask() -> None:
    masks = blobs(30, 1, 14)
    patches = patches_of(masks)
    for number, mask in enumerate(masks):
        for turn in range(TURNS):
            turned = TURNS * number + turn
            drawn = np.zeros(tuple(patches.shapes[turned]), bool)
            for row, col, length in patches.runs[patches.starts[turned] : patches.starts[turned + 1]].tolist():
                drawn[row, col : col + length] = True
            np.testing.assert_array_equal(drawn, np.rot90(mask, turn))
            edge, row, col = patches.squares[turned].tolist()
            assert drawn[row : row + edge, col : col + edge].sum() == edge * edge > 0
        assert patches.pixels[number] == mask.sum()


def test_that_turns_that_look_alike_are_tried_once() -> None:
    corner = np.array([[True, True], [True, False]])
    masks = [np.ones((3, 3), bool), np.ones((2, 5), bool), corner]
    distinct = patches_of(masks).distinct.reshape(-1, TURNS)
    np.testing.assert_array_equal(distinct.sum(axis=1), [1, 2, 4])


def test_that_the_column_of_a_square_is_that_of_a_full_search() -> None:
    rng = np.random.default_rng(3)
    page, taken = nothing_taken(60, 300), np.zeros((60, 300), bool)
    patches = patches_of([np.ones((3, 9), bool)])
    for row, col in rng.integers(0, (58, 292), (150, 2)).tolist():
        if not taken[row : row + 3, col : col + 9].any():
            taken[row : row + 3, col : col + 9] = True
            occupy(page, patches.runs[: patches.starts[1]], row, col)
        size, at = int(rng.integers(len(SQUARES))), int(rng.integers(60))
        edge = SQUARES[size]
        free = [c for c in range(301 - edge) if at + edge <= 60 and not taken[at : at + edge, c : c + edge].any()]
        assert square_column(page, size, at) == (free[0] if free else NONE)
