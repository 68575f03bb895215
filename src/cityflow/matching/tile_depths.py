"""Depths of a reference image by the ground tile that their points stand in, put together square by square."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array
from cityflow.core.depth_map import DepthMap
from cityflow.core.pixels import Pixels


class Merged(NamedTuple):
    """Depth, sigma (h, w) float32 and views (h, w) uint8 of a window of the reference image that begins at `row` and `col`."""

    row: int
    col: int
    depth: Float32Array
    sigma: Float32Array
    views: ByteArray


@dataclass(frozen=True, slots=True)
class _Piece:
    """What a tile gets of a window: nothing but the rows and columns between its first and last point; sigma as it is written."""

    row: int
    col: int
    depth: Float32Array
    sigma: NDArray[np.float16]
    views: ByteArray


class TileDepths:
    """Pieces of the depth maps of ground tiles.

    Attributes
    ----------
    points : name of the ground tile → pixels with a depth so far
    """

    def __init__(self, image: str, pixels: Pixels) -> None:
        self._image, self._pixels = image, pixels
        self._pieces: dict[str, list[_Piece]] = {}
        self.points: Counter[str] = Counter()

    def add(self, tile: str, found: Merged, kept: BoolArray) -> None:
        """Give a tile the pixels that are its own."""
        rows, cols = np.flatnonzero(kept.any(axis=1)), np.flatnonzero(kept.any(axis=0))
        if not len(rows):
            return
        at = np.s_[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
        own, none = kept[at], np.float32(np.nan)
        piece = _Piece(
            found.row + int(rows[0]), found.col + int(cols[0]), np.where(own, found.depth[at], none),
            np.where(own, found.sigma[at], none).astype(np.float16), np.where(own, found.views[at], np.uint8(0)),
        )  # fmt: skip
        self._pieces.setdefault(tile, []).append(piece)
        self.points[tile] += int(own.sum())

    def take(self, tile: str) -> DepthMap | None:
        """The depth map of a tile, from its first to its last point; no colour where there is no depth; None where it has no point. Its pieces are dropped."""
        pieces = self._pieces.pop(tile, [])
        if not pieces:
            return None
        top, left = min(p.row for p in pieces), min(p.col for p in pieces)
        bottom = max(p.row + p.depth.shape[0] for p in pieces)
        right = max(p.col + p.depth.shape[1] for p in pieces)
        shape = bottom - top, right - left
        depth, sigma = np.full(shape, np.nan, np.float32), np.full(shape, np.nan, np.float32)
        views = np.zeros(shape, np.uint8)
        for p in pieces:
            at = np.s_[p.row - top : p.row - top + p.depth.shape[0], p.col - left : p.col - left + p.depth.shape[1]]
            depth[at], sigma[at], views[at] = p.depth, p.sigma, p.views
        colour = np.array(self._pixels.window((top, bottom), (left, right)))
        colour[np.isnan(depth)] = 0
        return DepthMap(self._image, top, left, depth, sigma, views, colour)
