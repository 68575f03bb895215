"""A whole image at one coarse level, decoded as cheaply as its format allows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rasterio.enums import Resampling

from cityflow.core.pixels import PixelArray, level_shape
from cityflow.io.images.image_header import kind_of, opened


@dataclass(frozen=True, slots=True)
class CoarsePixels:
    """One level of an image in memory; implements `core.pixels.Pixels` for that level alone.

    Attributes
    ----------
    height, width : pixels at level 0;  level : the one there is
    array : (rows, cols, bands) of that level
    """

    height: int
    width: int
    level: int
    array: PixelArray

    @property
    def bands(self) -> int:
        return int(self.array.shape[2])

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.array.dtype

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        """As `core.pixels.Pixels.window`; raises ValueError for any other level."""
        if level != self.level:
            raise ValueError(f"only level {self.level} is there, not {level}")
        return self.array[rows[0] : rows[1], cols[0] : cols[1]]


def coarse_image(path: str | Path, level: int) -> CoarsePixels:
    """Decode an image at a pyramid level. JPEGs are decoded at an eighth of their size, which takes a fraction of the time.

    Raises
    ------
    CatalogError
        The file is missing, truncated, damaged, or of a kind that is not used.
    """
    with opened(path) as dataset:
        bands, _ = kind_of(dataset)
        shape = (len(bands), *level_shape(dataset.height, dataset.width, level))
        array = dataset.read(list(bands), out_shape=shape, resampling=Resampling.average)
        return CoarsePixels(dataset.height, dataset.width, level, np.ascontiguousarray(np.moveaxis(array, 0, -1)))
