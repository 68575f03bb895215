"""Converts an image to a tiled, lossless file with its pyramid, to be read by raster window."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import rasterio
from pydantic import Field
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.io import DatasetReader, DatasetWriter
from rasterio.windows import Window

from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import PixelArray, level_shape
from cityflow.errors import CatalogError
from cityflow.io.images.image_header import kind_of, opened

MOST_LEVELS = 8
"""Sums of 4**7 pixels of 16 bits, doubled for the rounding, still fit into 32 bits."""

SMALLEST_PX = 256
"""No level below the first whose longer side is at most this."""

JPEG_START, JPEG_END = b"\xff\xd8", b"\xff\xd9"
TAIL_BYTES = 1 << 16
ZSTD_LEVEL = 1
"""Of compression: files are 4 % larger than at level 3, and made in 0.8 of the time."""


class TilingParameters(Parameters):
    """How images are stored."""

    tile_px: Literal[256, 512] = Field(512, description="edge of a tile, pixels")
    compression: Literal["zstd", "deflate"] = Field("zstd", description="both lossless; deflate opens everywhere")


DEFAULT = TilingParameters()


def tile_image(source: str | Path, target: str | Path, parameters: TilingParameters = DEFAULT) -> None:
    """Write `source` as a tiled TIFF with all its levels; the same picture gives the same bytes.

    The source is decoded once, strip by strip; of the picture only the reduced levels, a third of it, are ever in memory.
    Palettes become colours. An alpha band is left out; what is wholly transparent, masked, or no data by the file's own word becomes black.

    Raises
    ------
    CatalogError
        The file is missing, no image, truncated or otherwise damaged.
    """
    with picture_strips(source, parameters.tile_px) as picture:
        tile_strips(picture, target, parameters)


@dataclass(frozen=True, slots=True)
class Strips:
    """A picture that comes strip by strip.

    Attributes
    ----------
    height, width, bands : of the picture
    dtype : ``uint8`` or ``uint16``
    strips : first row and (rows, width, bands) pixels, from above, without gaps; all but the last of the same number of rows, which is a multiple of
        a tile's edge
    """

    height: int
    width: int
    bands: int
    dtype: str
    strips: Iterable[tuple[int, PixelArray]]


@contextlib.contextmanager
def picture_strips(source: str | Path, rows: int) -> Iterator[Strips]:
    """A picture decoded once from above, `rows` rows at a time; raises as `tile_image`."""
    _refuse_cut_jpeg(Path(source))
    with opened(source) as dataset:
        bands, dtype = kind_of(dataset)
        yield Strips(dataset.height, dataset.width, len(bands), dtype, _strips(dataset, bands, rows))


def tile_strips(
    picture: Strips, target: str | Path, parameters: TilingParameters = DEFAULT, most_levels: int = MOST_LEVELS
) -> None:
    """As `tile_image`, from a picture that somebody makes strip by strip.

    Parameters
    ----------
    most_levels : 1 writes the picture alone, for a step between
    """
    shape = picture.height, picture.width
    levels = min(level_count(*shape), most_levels)
    layout = _layout(picture.bands, picture.dtype, parameters)
    pyramid = _Pyramid(shape, picture.bands, np.dtype(picture.dtype), levels)
    with _created(target, shape, layout, levels) as out:
        for row, strip in picture.strips:
            _write(out, row, strip)
            pyramid.add(row, strip)
    for level in range(1, levels):
        reduced = pyramid.levels[level]
        with _created(target, reduced.shape[:2], {**layout, "APPEND_SUBDATASET": "YES"}, 0) as out:
            _write(out, 0, reduced)


def level_count(height: int, width: int) -> int:
    """How many levels are stored, level 0 counted.

    >>> level_count(10652, 14204)
    7
    """
    levels = 1
    while levels < MOST_LEVELS and max(level_shape(height, width, levels - 1)) > SMALLEST_PX:
        levels += 1
    return levels


class _Pyramid:
    """Reduced levels, filled strip by strip from above; strips start at multiples of the tile, thus of every level's step."""

    def __init__(self, shape: tuple[int, int], bands: int, dtype: np.dtype[Any], levels: int) -> None:
        self.shape = shape
        sizes = {level: level_shape(*shape, level) for level in range(1, levels)}
        # band by band in memory, as they are written
        self.levels = {level: np.moveaxis(np.empty((bands, *size), dtype), 0, -1) for level, size in sizes.items()}

    def add(self, row: int, strip: PixelArray) -> None:
        sums = np.ascontiguousarray(np.moveaxis(strip, -1, 0))
        for level, target in self.levels.items():
            sums = _halved(sums)
            first = row >> level
            tall, wide = _spans(strip.shape[0], level), _spans(self.shape[1], level)
            _means(sums, tall, wide, level, target[first : first + sums.shape[1]])


def _spans(length: int, level: int) -> np.ndarray[Any, np.dtype[np.uint32]]:
    """Pixels of level 0 along each one of a level."""
    starts = np.arange(0, length, 1 << level)
    return np.minimum(length - starts, 1 << level).astype(np.uint32)


@njit(cache=True, nogil=True)
def _halved(sums):  # type: ignore[no-untyped-def]
    """Sums (bands, rows, cols) of pairs of rows and of columns, uint32; a last one without a partner stands alone."""
    bands, rows, cols = sums.shape
    out = np.zeros((bands, (rows + 1) // 2, (cols + 1) // 2), np.uint32)
    for k in range(bands):
        for i in range(rows):
            own, row = out[k, i // 2], sums[k, i]
            for j in range(cols // 2):
                own[j] += np.uint32(row[2 * j]) + np.uint32(row[2 * j + 1])
            if cols % 2:
                own[cols // 2] += np.uint32(row[cols - 1])
    return out


@njit(cache=True, nogil=True)
def _means(sums, tall, wide, level, out):  # type: ignore[no-untyped-def]
    """Rounded means (rows, cols, bands); `tall` and `wide` are rows and columns of the pixels that were summed up, mostly all that a level may have."""
    whole = np.uint32(1) << np.uint32(2 * level)
    half, bits = np.uint32(whole // 2), np.uint32(2 * level)
    for i in range(sums.shape[1]):
        for j in range(sums.shape[2]):
            count = np.uint32(tall[i] * wide[j])
            for k in range(sums.shape[0]):
                if count == whole:
                    out[i, j, k] = (sums[k, i, j] + half) >> bits
                else:
                    out[i, j, k] = (2 * sums[k, i, j] + count) // (2 * count)


def _strips(dataset: DatasetReader, bands: tuple[int, ...], rows: int) -> Iterator[tuple[int, PixelArray]]:
    """Full-width strips from above, so that decoders which only go forward never start again."""
    palette = _palette(dataset)
    for row in range(0, dataset.height, rows):
        window = Window(0, row, dataset.width, min(rows, dataset.height - row))
        if palette is not None:
            yield row, palette[dataset.read(1, window=window)]
        else:
            yield row, np.moveaxis(_shown(dataset, bands, window), 0, -1)


def _shown(dataset: DatasetReader, bands: tuple[int, ...], window: Window) -> PixelArray:
    """(bands, rows, cols) of a window, black where the file says that it shows nothing."""
    alpha = [i for i, kind in enumerate(dataset.colorinterp, start=1) if kind == ColorInterp.alpha]
    if alpha:
        # together, as decoders that only go forward would start again
        values = dataset.read((*bands, alpha[0]), window=window)
        return np.where(values[-1] > 0, values[:-1], values.dtype.type(0))
    values = dataset.read(bands, window=window)
    if MaskFlags.all_valid not in dataset.mask_flag_enums[0]:
        values[:, dataset.dataset_mask(window=window) == 0] = 0
    return values


def _palette(dataset: DatasetReader) -> PixelArray | None:
    """(256, 3) colours of a picture with a palette."""
    if dataset.colorinterp[0] != ColorInterp.palette:
        return None
    table = np.zeros((256, 3), np.uint8)
    for number, colour in dataset.colormap(1).items():
        table[number] = colour[:3] if colour[3] else 0
    return table


def _layout(bands: int, dtype: str, parameters: TilingParameters) -> dict[str, Any]:
    tile = parameters.tile_px
    return {
        "driver": "GTiff", "count": bands, "dtype": dtype, "tiled": True, "blockxsize": tile, "blockysize": tile,
        "interleave": "pixel", "compress": parameters.compression, "predictor": 2, "num_threads": "1",
        "photometric": "MINISBLACK" if bands == 1 else "RGB", "bigtiff": "IF_SAFER",
        **({"zstd_level": ZSTD_LEVEL} if parameters.compression == "zstd" else {"zlevel": 6}),
        **({"alpha": "NO"} if bands == 4 else {}),
    }  # fmt: skip


@contextlib.contextmanager
def _created(
    target: str | Path, shape: tuple[int, int], layout: dict[str, Any], levels: int
) -> Iterator[DatasetWriter]:
    """A new file, or a further image of it; `levels` is written into the first."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        with rasterio.open(target, "w", height=shape[0], width=shape[1], **layout) as dataset:
            if levels:
                dataset.update_tags(CITYFLOW_LEVELS=str(levels))
            yield dataset


def _write(out: DatasetWriter, row: int, strip: PixelArray) -> None:
    try:
        out.write(np.moveaxis(strip, -1, 0), window=Window(0, row, strip.shape[1], strip.shape[0]))
    except RasterioError as error:
        raise CatalogError(f"cannot be written: {error}", where=str(out.name), remedy="check the disk space") from error


def _refuse_cut_jpeg(path: Path) -> None:
    """libjpeg fills what is missing with grey and only warns; a file whose last marker is missing was cut."""
    if "://" in str(path) or not path.is_file():
        return
    with path.open("rb") as file:
        if file.read(2) != JPEG_START:
            return
        size = file.seek(0, 2)
        file.seek(max(0, size - TAIL_BYTES))
        if JPEG_END not in file.read():
            raise CatalogError(
                f"truncated JPEG: it ends after {size} bytes without an end marker",
                where=str(path),
                remedy="copy the file again, or leave the image out",
            )
