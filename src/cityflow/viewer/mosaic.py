"""Rasters of a whole city, reduced tile by tile: memory depends on the picture, not on the city."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.core.grid import Grid


class Mosaic:
    """Mean of every `factor` × `factor` cells of a grid, tile after tile.

    Parameters
    ----------
    grid : what the picture shows;  most : longest side of the picture, pixels;  bands : of the rasters

    >>> mosaic = Mosaic(Grid(0.0, 4.0, 1.0, 4, 4), most=2)
    >>> mosaic.add(Grid(0.0, 4.0, 1.0, 4, 2), np.arange(8.0).reshape(1, 4, 2), np.ones((4, 2), bool))
    >>> mosaic.grid, mosaic.mean()[0].tolist()
    (Grid(x_min=0.0, y_max=4.0, cell=2.0, rows=2, cols=2), [[1.5, nan], [5.5, nan]])
    """

    def __init__(self, grid: Grid, most: int, bands: int = 1) -> None:
        self.factor = max(math.ceil(max(grid.shape) / most), 1)
        self._whole = grid
        rows, cols = (math.ceil(n / self.factor) for n in grid.shape)
        self.grid = Grid(grid.x_min, grid.y_max, grid.cell * self.factor, rows, cols)
        self._sum = np.zeros((bands, rows, cols))
        self._count = np.zeros((rows, cols), np.int64)

    def add(self, part: Grid, values: NDArray[Any], known: BoolArray) -> None:
        """Take in (bands, rows, cols) values of a part of the grid, of those cells that are known."""
        rows, cols = self._whole.slices(part)
        first_row, row_starts = _starts(rows, self.factor)
        first_col, col_starts = _starts(cols, self.factor)
        place = np.s_[first_row : first_row + len(row_starts), first_col : first_col + len(col_starts)]
        for band, total in zip(values, self._sum, strict=True):
            total[place] += _summed(np.where(known, band, 0).astype(np.float64), row_starts, col_starts)
        self._count[place] += _summed(known.astype(np.int64), row_starts, col_starts)

    def mean(self) -> Float32Array:
        """(bands, rows, cols) of `grid`; NaN where nothing is known."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self._sum / self._count, np.float32)


def _starts(part: slice, factor: int) -> tuple[int, NDArray[np.int64]]:
    """The first cell of the picture that a part touches, and where each one begins within the part."""
    edges = np.arange(part.start // factor, (part.stop - 1) // factor + 1) * factor - part.start
    return part.start // factor, np.maximum(edges, 0)


def _summed(values: NDArray[Any], rows: NDArray[np.int64], cols: NDArray[np.int64]) -> NDArray[Any]:
    return np.asarray(np.add.reduceat(np.add.reduceat(values, rows, axis=0), cols, axis=1))


def known_window(known: BoolArray) -> tuple[slice, slice]:
    """Rows and columns between the first and the last known cell; all where none is.

    >>> known_window(np.array([[False, False], [False, True]]))
    (slice(1, 2, None), slice(1, 2, None))
    """
    return _between(np.asarray(known.any(axis=1))), _between(np.asarray(known.any(axis=0)))


def _between(known: BoolArray) -> slice:
    found = np.flatnonzero(known)
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, len(known))
