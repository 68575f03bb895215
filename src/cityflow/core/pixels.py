"""Interface to the pixels of an image: by raster window and pyramid level, never the whole image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

AT_ONCE = 1 << 20
"""Pixels that are averaged at once."""
LUMA = (0.299, 0.587, 0.114)
"""Red, green and blue in brightness (Rec. ITU-R BT.601)."""

PixelArray = NDArray[Any]
"""(rows, cols, bands) uint8 or uint16."""


class Pixels(Protocol):
    """An image that is read by window.

    Attributes
    ----------
    height, width : pixels at level 0
    bands : 1 (grey), 3 (red, green, blue) or 4 (with near infrared)
    dtype : uint8 or uint16
    """

    @property
    def height(self) -> int: ...
    @property
    def width(self) -> int: ...
    @property
    def bands(self) -> int: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        """(rows, cols, bands) of half-open ranges in pixels of `level`.

        Pixel (r, c) of level k is the mean of the 2**k × 2**k pixels of level 0 from (r·2**k, c·2**k) on; the last row and column of a level
        may be means of fewer. The size of level k is ceil(size / 2**k). Ranges must lie inside the level.
        """
        ...


def level_shape(height: int, width: int, level: int) -> tuple[int, int]:
    """Rows and columns of a pyramid level.

    >>> level_shape(1200, 1601, 2)
    (300, 401)
    """
    step = 1 << level
    return -(-height // step), -(-width // step)


@dataclass(frozen=True)
class ArrayPixels:
    """An image that is in memory: for notebooks, tests and small images."""

    array: PixelArray

    @property
    def height(self) -> int:
        return int(self.array.shape[0])

    @property
    def width(self) -> int:
        return int(self.array.shape[1])

    @property
    def bands(self) -> int:
        return int(self.array.shape[2])

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.array.dtype

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        step = 1 << level
        part = self.array[rows[0] * step : rows[1] * step, cols[0] * step : cols[1] * step]
        return part if level == 0 else reduced(part, level)


@dataclass(frozen=True)
class PixelsOf:
    """What an image made of another one has in common with it; its window is its own."""

    pixels: Pixels

    @property
    def height(self) -> int:
        return self.pixels.height

    @property
    def width(self) -> int:
        return self.pixels.width

    @property
    def bands(self) -> int:
        return self.pixels.bands

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.pixels.dtype


@dataclass(frozen=True)
class ReducedPixels(PixelsOf):
    """A pyramid level of an image as an image of its own."""

    of_level: int

    @property
    def height(self) -> int:
        return level_shape(self.pixels.height, self.pixels.width, self.of_level)[0]

    @property
    def width(self) -> int:
        return level_shape(self.pixels.height, self.pixels.width, self.of_level)[1]

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        return self.pixels.window(rows, cols, level + self.of_level)


def reduced(array: PixelArray, level: int) -> PixelArray:
    """Means of blocks of 2**level pixels, rounded half up; blocks at the end may be smaller."""
    step = 1 << level
    # sums take eight bytes a value, so not of a large image all at once
    rows = max(AT_ONCE // max(array.shape[1] * step, 1), 1) * step
    return np.concatenate([_means(array[first : first + rows], step) for first in range(0, max(len(array), 1), rows)])


def _means(array: PixelArray, step: int) -> PixelArray:
    rows, cols = array.shape[:2]
    starts_r, starts_c = np.arange(0, rows, step), np.arange(0, cols, step)
    sums = np.add.reduceat(np.add.reduceat(array.astype(np.int64), starts_r, axis=0), starts_c, axis=1)
    tall = np.minimum(starts_r + step, rows) - starts_r
    wide = np.minimum(starts_c + step, cols) - starts_c
    count = (tall[:, None] * wide[None, :])[..., None]
    return ((2 * sums + count) // (2 * count)).astype(array.dtype)
