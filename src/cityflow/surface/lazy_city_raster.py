"""Rasters of a whole city as lazy arrays: coarser cells, relief, difference of two epochs.

All take and give xarray's arrays over Dask, dimensions (y, x), north up, a chunk per ground tile. Nothing is computed here.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import warnings
from typing import Any

import dask.array as da
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray, Float32Array
from cityflow.geometry.hill_shade import hill_shade

DARK, GREY_OF_LEVEL = 1, 150.0
"""Grey values of a relief: 0 is no data; level ground is of medium brightness."""


def coarser(heights: xr.DataArray, factor: int) -> xr.DataArray:
    """Mean of the known ones of every `factor` × `factor` cells, float32; NaN where none is known.

    Raises
    ------
    ValueError
        A chunk is no multiple of `factor`: its last cells would share one with the next chunk.
    """
    if factor == 1:
        return heights.astype(np.float32)
    chunks = heights.chunksizes
    if any(n % factor for axis in ("y", "x") for n in chunks[axis]):
        raise ValueError(f"chunks of {chunks} cells are no multiple of {factor}")
    smaller = tuple(tuple(n // factor for n in chunks[axis]) for axis in ("y", "x"))
    values = da.map_blocks(_means, heights.data, factor=factor, dtype=np.float32, chunks=smaller)
    middles = {axis: heights[axis].values.reshape(-1, factor).mean(axis=1) for axis in ("y", "x")}
    return xr.DataArray(values, middles, ("y", "x"), heights.name, heights.attrs)


def relief(heights: xr.DataArray, cell: float) -> xr.DataArray:
    """Grey values, uint8, 0 where no height is known: light from the north-west; `cell` in metres."""
    shaded = da.map_overlap(
        _grey, heights.data, depth=1, boundary=np.nan, trim=True, dtype=np.uint8, cell=cell, meta=np.empty((0, 0), np.uint8)
    )  # fmt: skip
    return heights.copy(data=shaded).rename("relief")


def difference(new: xr.DataArray, old: xr.DataArray, cell: float) -> xr.DataArray:
    """`new` minus `old` on the cells that both have, NaN where one of them is not known.

    Raises
    ------
    ValueError
        They have no cell in common, or their cells do not stand on one lattice.
    """
    ours, theirs = (_numbered(each, cell) for each in (new, old))
    ours, theirs = xr.align(ours, theirs, join="inner")
    if not ours.size:
        raise ValueError("the two have no cell in common")
    less = ours - theirs
    return less.assign_coords(y=(less["y"] + 0.5) * cell, x=(less["x"] + 0.5) * cell).rename("difference")


def _numbered(values: xr.DataArray, cell: float) -> xr.DataArray:
    """Coordinates as whole numbers of cells from the origin of the CRS, which two runs share."""
    places = {axis: values[axis].values / cell - 0.5 for axis in ("y", "x")}
    numbers = {axis: np.rint(place) for axis, place in places.items()}
    if any(np.abs(numbers[axis] - places[axis]).max(initial=0) > 0.01 for axis in places):
        raise ValueError(f"cells of {cell:g} m do not begin at multiples of {cell:g} m")
    return values.assign_coords(numbers)


def _means(block: NDArray[Any], factor: int) -> Float32Array:
    rows, cols = (n // factor for n in block.shape)
    parts = block.astype(np.float64).reshape(rows, factor, cols, factor)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Mean of empty slice")
        return np.nanmean(parts, axis=(1, 3)).astype(np.float32)


def _grey(block: Float32Array, cell: float) -> ByteArray:
    if min(block.shape) < 2:  # Dask tries functions on empty arrays
        return np.zeros(block.shape, np.uint8)
    grey = np.clip(hill_shade(block, cell) * GREY_OF_LEVEL, DARK, 255)
    return np.where(np.isfinite(block), grey, 0).astype(np.uint8)
