"""8-bit grey windows of an image for matching, each tile decoded once and kept as long as memory allows."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from typing import NamedTuple

import cv2
import numpy as np

from cityflow.core.arrays import ByteArray
from cityflow.core.pixels import PixelArray, Pixels, level_shape

TILE_PX = 512
"""Pixels are read in tiles of this edge; no result depends on it."""


class TileKey(NamedTuple):
    """Which tile of which image, on which level of its pyramid."""

    image: str
    level: int
    row: int
    col: int


@dataclass
class TileStore:
    """Tiles of all images of a match, the longest unused ones dropped beyond `limit` bytes."""

    limit: int
    tiles: OrderedDict[TileKey, ByteArray] = field(default_factory=OrderedDict)
    held: int = 0

    def get(self, key: TileKey) -> ByteArray | None:
        tile = self.tiles.get(key)
        if tile is not None:
            self.tiles.move_to_end(key)
        return tile

    def put(self, key: TileKey, tile: ByteArray) -> None:
        self.tiles[key] = tile
        self.held += tile.nbytes
        while self.held > self.limit and len(self.tiles) > 1:
            self.held -= self.tiles.popitem(last=False)[1].nbytes


@dataclass
class GreyImage:
    """Grey values of one image, stretched to 8 bits by the same curve all over the image.

    Exposures differ between images, so each is stretched between its own percentiles, taken from a coarse level of the whole image.
    """

    name: str
    pixels: Pixels
    store: TileStore
    curve: ByteArray

    @classmethod
    def of(cls, name: str, pixels: Pixels, store: TileStore) -> GreyImage:
        level = max(0, int(np.log2(max(min(pixels.height, pixels.width) / 256.0, 1.0))))
        rows, cols = level_shape(pixels.height, pixels.width, level)
        return cls(name, pixels, store, _curve(_grey(pixels.window((0, rows), (0, cols), level))))

    def shape(self, level: int) -> tuple[int, int]:
        return level_shape(self.pixels.height, self.pixels.width, level)

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int) -> ByteArray:
        """(rows, cols) uint8 of half-open ranges inside the level."""
        out = np.empty((rows[1] - rows[0], cols[1] - cols[0]), np.uint8)
        for tile_row in range(rows[0] // TILE_PX, (rows[1] - 1) // TILE_PX + 1):
            for tile_col in range(cols[0] // TILE_PX, (cols[1] - 1) // TILE_PX + 1):
                tile = self._tile(level, tile_row, tile_col)
                top, left = tile_row * TILE_PX, tile_col * TILE_PX
                r0, r1 = max(rows[0], top), min(rows[1], top + tile.shape[0])
                c0, c1 = max(cols[0], left), min(cols[1], left + tile.shape[1])
                out[r0 - rows[0] : r1 - rows[0], c0 - cols[0] : c1 - cols[0]] = tile[
                    r0 - top : r1 - top, c0 - left : c1 - left
                ]
        return out

    def _tile(self, level: int, row: int, col: int) -> ByteArray:
        key = TileKey(self.name, level, row, col)
        tile = self.store.get(key)
        if tile is None:
            height, width = self.shape(level)
            rows = (row * TILE_PX, min((row + 1) * TILE_PX, height))
            cols = (col * TILE_PX, min((col + 1) * TILE_PX, width))
            grey = _grey(self.pixels.window(rows, cols, level))
            # OpenCV looks up bytes four times as fast
            tile = np.asarray(cv2.LUT(grey, self.curve)) if grey.dtype == np.uint8 else self.curve[grey]
            self.store.put(key, tile)
        return tile


def _grey(pixels: PixelArray) -> PixelArray:
    """(rows, cols) of the same type: luma of the first three bands, or the only band."""
    if pixels.shape[2] < 3:
        return np.ascontiguousarray(pixels[:, :, 0])
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(pixels[:, :, :3]), cv2.COLOR_RGB2GRAY))


def _curve(sample: PixelArray) -> ByteArray:
    """Table from grey values to 8 bits. 16-bit values get a square-root curve: it evens out photon noise and opens the shadows."""
    low, high = np.percentile(sample, [0.5, 99.5])
    share = np.clip((np.arange(np.iinfo(sample.dtype).max + 1) - low) / max(high - low, 1.0), -0.04, 1.08)
    if sample.dtype == np.uint16:
        share = np.sign(share) * np.sqrt(np.abs(share))
    return np.clip(np.rint(12.0 + 220.0 * share), 0, 255).astype(np.uint8)
