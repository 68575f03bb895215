"""White level of an orthophoto: 8 bits, 16 bits of which 12 or 11 are used, or fractions of one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rasterio
from rasterio.errors import RasterioError
from rasterio.windows import Window

from cityflow.errors import CatalogError

WHITE = 255.0
ALONG, WINDOW_PX = 8, 64
"""Windows along either side of a raster that tell its white level, and their size."""
SHARE = 99.9
"""Of the values of the windows that are not above the white level, percent."""


def white_of_raster(path: str | Path) -> float:
    """255 of 8 bits; else, from a lattice of windows over the whole file, whoever asks: a power of two less one, or 1 where all are fractions.

    Raises
    ------
    CatalogError
        The file is missing or damaged.
    """
    try:
        with rasterio.open(path) as raster:
            if raster.dtypes[0] == "uint8":
                return WHITE
            bands = [b for b in (1, 2, 3) if b <= raster.count]
            values = np.concatenate([_known(raster.read(bands, window=w, masked=True)) for w in _windows(raster.shape)])
    except RasterioError as error:
        raise CatalogError(
            f"cannot be read: {error}", where=str(path), remedy="check that the file is whole"
        ) from error
    if not len(values):
        return WHITE
    brightest = float(np.percentile(values, SHARE))
    if not np.issubdtype(values.dtype, np.integer) and brightest <= 1.0:
        return 1.0
    return float(2 ** int(np.ceil(np.log2(max(brightest, WHITE) + 1.0))) - 1)


def _windows(shape: tuple[int, int]) -> list[Window]:
    """Evenly over a raster; those of a small one lie over each other."""
    tall, wide = (min(WINDOW_PX, n) for n in shape)
    rows, cols = (np.linspace(0, n - size, ALONG).astype(int) for n, size in zip(shape, (tall, wide), strict=True))
    return [Window(int(c), int(r), wide, tall) for r in np.unique(rows) for c in np.unique(cols)]


def _known(values: np.ma.MaskedArray) -> np.ndarray:
    found = values.compressed()
    return found if np.issubdtype(found.dtype, np.integer) else found[np.isfinite(found)]
