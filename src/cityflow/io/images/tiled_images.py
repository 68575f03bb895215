"""Reads images of `image_tiles` by raster window and pyramid level."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rasterio.errors import RasterioError
from rasterio.io import DatasetReader
from rasterio.windows import Window

from cityflow.core.pixels import PixelArray, level_shape, reduced
from cityflow.errors import CatalogError
from cityflow.io.images.image_header import ImageHeader, check_against, check_size, image_header, open_dataset, opened
from cityflow.io.images.image_tiles import TilingParameters, tile_image

__all__ = [
    "ImageHeader", "TiledImage", "TilingParameters", "check_against", "check_size", "image_header", "open_image", "tile_image",
]  # fmt: skip


OPEN_LEVELS = 64
"""Levels of images that a process has open: each holds some 4 MB, and a child that holds a gigabyte is replaced. To open one again takes half a millisecond."""


@dataclass(slots=True, weakref_slot=True)
class TiledImage:
    """A tiled image with its levels, opened when first read; implements `core.pixels.Pixels`.

    Not for several threads at once; processes get copies that open the file anew.
    """

    path: str
    height: int
    width: int
    bands: int
    dtype: np.dtype[Any]
    levels: int
    _open: dict[int, DatasetReader] = field(default_factory=dict, repr=False, compare=False)

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> PixelArray:
        """As `core.pixels.Pixels.window`; a level beyond the stored ones is computed from the coarsest exact one, level 0.

        Raises
        ------
        CatalogError
            The file is damaged.
        """
        tall, wide = level_shape(self.height, self.width, level)
        if not (0 <= rows[0] <= rows[1] <= tall and 0 <= cols[0] <= cols[1] <= wide):
            raise ValueError(
                f"rows {rows} and columns {cols} do not lie inside level {level} of {tall} × {wide} pixels"
            )
        if rows[0] == rows[1] or cols[0] == cols[1]:
            return np.empty((rows[1] - rows[0], cols[1] - cols[0], self.bands), self.dtype)
        if level < self.levels:
            return self._read(rows, cols, level)
        ends = min(rows[1] << level, self.height), min(cols[1] << level, self.width)
        return reduced(self._read((rows[0] << level, ends[0]), (cols[0] << level, ends[1]), 0), level)

    def close(self) -> None:
        for dataset in self._open.values():
            dataset.close()
        for level in self._open:
            _LATELY.pop((id(self), level), None)
        self._open.clear()

    def _read(self, rows: tuple[int, int], cols: tuple[int, int], level: int) -> PixelArray:
        window = Window.from_slices(rows, cols)
        try:
            if level not in self._open:
                self._open[level] = open_dataset(level_name(self.path, level))
            _remember(self, level)
            return _side_by_side(self._open[level].read(window=window))
        except RasterioError as error:
            raise CatalogError(
                f"the tiled image is damaged: {error}", where=self.path, remedy="tile it again: rerun ingest"
            ) from error

    def __getstate__(self) -> tuple[Any, ...]:
        return self.path, self.height, self.width, self.bands, self.dtype, self.levels

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.path, self.height, self.width, self.bands, self.dtype, self.levels = state
        self._open = {}


def _side_by_side(bands: PixelArray) -> PixelArray:
    """(rows, cols, bands) of (bands, rows, cols); OpenCV takes a fortieth of numpy's time."""
    return bands[0][..., None] if len(bands) == 1 else np.asarray(cv2.merge(list(bands)))


_LATELY: OrderedDict[tuple[int, int], TiledImage] = OrderedDict()
"""Images with open levels, those read last at the end."""


def _remember(image: TiledImage, level: int) -> None:
    """Close what was read longest ago where too much is open; it is opened anew when it is read again."""
    key = id(image), level
    _LATELY[key] = image
    _LATELY.move_to_end(key)
    while len(_LATELY) > OPEN_LEVELS:
        (_, oldest), other = _LATELY.popitem(last=False)
        other._open.pop(oldest).close()


def open_image(path: str | Path) -> TiledImage:
    """An image that `tile_image` wrote.

    Raises
    ------
    CatalogError
        The file is missing, or not tiled by `tile_image`.
    """
    with opened(path) as dataset:
        levels = int(dataset.tags().get("CITYFLOW_LEVELS", 0))
        if not levels:
            raise CatalogError("this image is not tiled yet", where=str(path), remedy="tile it first: run ingest")
        dtype = np.dtype(dataset.dtypes[0])
        return TiledImage(str(path), dataset.height, dataset.width, dataset.count, dtype, levels)


def level_name(path: str | Path, level: int) -> str:
    """GDAL's name of a level: the levels are further images of the same file."""
    return str(path) if level == 0 else f"GTIFF_DIR:{level + 1}:{path}"
