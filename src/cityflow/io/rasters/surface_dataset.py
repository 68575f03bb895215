"""``surface.zarr`` as an xarray Dataset: windows for the stages, and one Dask chunk per ground tile for what looks at the whole city."""

from __future__ import annotations

import os
from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import zarr
from numpy.typing import NDArray

from cityflow.core.grid import Bounds, Grid
from cityflow.io.rasters.surface_zarr import LAYERS, StoreLike, window_of

if TYPE_CHECKING:
    import xarray as xr

KEPT = 8
"""Datasets that a process keeps open: the surface, its overview, and local reference frames. Each holds its coordinates, no cells."""


def read_layers(
    store: StoreLike, grid: Grid, bounds: Bounds, names: Sequence[str] = tuple(LAYERS)
) -> tuple[Grid, dict[str, NDArray[Any]]]:
    """Windows of layers over `bounds`, cut at the edge of `grid` (that of all tiles): ([bands,] rows, cols), as stored.

    Raises
    ------
    ValueError
        `bounds` do not meet the grid.
    FileNotFoundError
        There is no surface.
    """
    window = window_of(grid, bounds)
    rows, cols = grid.slices(window)
    variables = open_surface(store).variables
    return window, {name: np.asarray(variables[name][..., rows, cols]) for name in names}


def open_surface(store: StoreLike) -> xr.Dataset:
    """The layers with their coordinates, values as stored; nothing is read before it is asked for. Opened once per process.

    Raises
    ------
    FileNotFoundError
        There is no surface.
    """
    return _kept(_Opened(store))


def chunked_surface(store: StoreLike) -> xr.Dataset:
    """As `open_surface`, of Dask arrays with one chunk per ground tile, with the CRS (`.rio.crs`). Raises FileNotFoundError."""
    import rioxarray  # noqa: F401 - gives arrays their `.rio`

    return _dataset(store, chunks={})


class _Opened:
    """A store, the same as another while what is written about its arrays is the same."""

    def __init__(self, store: StoreLike) -> None:
        self.store = store
        self._key: Hashable = (str(store), _version(store))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Opened) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=KEPT)
def _kept(opened: _Opened) -> xr.Dataset:
    return _dataset(opened.store)


def _version(store: StoreLike) -> Hashable:
    """Changes when the arrays are made anew, for another extent or tile, in a process that goes on."""
    if isinstance(store, str):
        found = os.stat(f"{store}/zarr.json")
        return found.st_mtime_ns, found.st_size, found.st_ino
    group = zarr.open_group(store, mode="r", zarr_format=3)
    return str(store.fs.to_json()), str(group.metadata)


def _dataset(store: StoreLike, chunks: dict[str, int] | None = None) -> xr.Dataset:
    import xarray as xr  # only where a surface is read: it takes half a second, and brings pandas

    return xr.open_dataset(
        store, engine="zarr", chunks=chunks, mask_and_scale=False, decode_times=False, decode_coords="all", cache=False
    )
