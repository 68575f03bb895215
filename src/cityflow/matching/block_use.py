"""Order in which a reference image is gone through, and the blocks of its pairs: matched when first needed, dropped after the last time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.camera import Camera
from cityflow.matching.lattice import Block, PairLattice
from cityflow.matching.needed import PART_PX, Window, blocks_under, blocks_within, part_corners

SQUARE_PARTS = 8
"""Pixels are merged in squares of so many parts: bounds memory."""


class Square(NamedTuple):
    """Pixels of the reference image that are merged at once, and the same as rows and columns of parts."""

    window: Window
    parts: tuple[slice, slice]


def squares_of(camera: Camera, needed: BoolArray) -> list[Square]:
    """Squares with a needed part, strip by strip along the shorter side of the image: few blocks are held at a time."""
    rows, cols = (range(0, n, SQUARE_PARTS) for n in needed.shape)
    by_rows = camera.width <= camera.height
    corners = [(r, c) for r in rows for c in cols] if by_rows else [(r, c) for c in cols for r in rows]
    return [_square(camera, r, c) for r, c in corners if needed[r : r + SQUARE_PARTS, c : c + SQUARE_PARTS].any()]


def _square(camera: Camera, row: int, col: int) -> Square:
    edge = SQUARE_PARTS * PART_PX
    top, left = row * PART_PX, col * PART_PX
    window = top, min(top + edge, camera.height), left, min(left + edge, camera.width)
    return Square(window, np.s_[row : row + SQUARE_PARTS, col : col + SQUARE_PARTS])


class BlockUse:
    """Blocks of one pair that are needed, square by square.

    Parameters
    ----------
    squares, needed : as of `squares_of`
    around : pixels of the reference image around a part whose disparities are needed with it
    kept : the first level that is kept whole

    Attributes
    ----------
    known, matched : pixels of level 0 with a disparity, and all that were matched
    """

    def __init__(
        self, lattice: PairLattice, squares: Sequence[Square], needed: BoolArray, around: int, kept: int
    ) -> None:
        self._lattice, self._around = lattice, around
        self.known = self.matched = 0
        last: dict[Block, int] = {}
        for number, square in enumerate(squares):
            last.update(dict.fromkeys(self._under(square, needed[square.parts]), number))
        self._drops: dict[int, list[tuple[int, Block]]] = {}
        for level in range(kept):
            for block, number in last.items():
                self._drops.setdefault(number, []).append((level, block))
            last = _coarser(last)

    def match(self, square: Square, needed: BoolArray) -> None:
        """Match what the needed parts of a square touch.

        Parameters
        ----------
        needed : (rows, cols) of the parts of the square
        """
        for block in self._under(square, needed):
            if (0, block) not in self._lattice.blocks:
                found = self._lattice.disparity(0, block)
                self.known += int(np.isfinite(found).sum())
                self.matched += found.size

    def drop(self, number: int) -> None:
        """Drop what no square after this one needs."""
        for level, block in self._drops.pop(number, ()):
            self._lattice.forget(level, block)

    def _under(self, square: Square, needed: BoolArray) -> list[Block]:
        """Blocks of level 0 that parts of a square and what is around them touch."""
        rows, cols = np.nonzero(needed)
        rows, cols = rows + square.parts[0].start, cols + square.parts[1].start
        pair = self._lattice.pair
        x, y = pair.rectified(pair.reference.camera.undistort(part_corners(self._lattice, rows, cols, self._around)))
        return _blocks(np.unique(blocks_under(self._lattice, 0, x, y), axis=0))


def _blocks(ends: IntArray) -> list[Block]:
    return sorted({block for one in ends.tolist() for block in blocks_within(one)})


def _coarser(last: dict[Block, int]) -> dict[Block, int]:
    """When a block of the coarser level guides one for the last time: those under it, and what their halos reach."""
    found: dict[Block, int] = {}
    for (row, col), number in last.items():
        for block in {((row + i) // 2, (col + j) // 2) for i in (-1, 0, 1) for j in (-1, 0, 1)}:
            found[block] = max(found.get(block, 0), number)
    return found
