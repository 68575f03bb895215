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
from cityflow.errors import RunError
from cityflow.io.rasters.surface_zarr import CRS_VARIABLE, LAYERS, StoreLike, window_of

if TYPE_CHECKING:
    import xarray as xr

KEPT = 8
"""Datasets that a process keeps open: the surface, its overview, and local reference frames. They hold no cells."""


def read_layers(
    store: StoreLike, grid: Grid, bounds: Bounds, names: Sequence[str] = tuple(LAYERS)
) -> tuple[Grid, dict[str, NDArray[Any]]]:
    """Windows of layers over `bounds`, whatever the survey covers of them: ([bands,] rows, cols), as stored; elsewhere no data.

    Parameters
    ----------
    grid : of all tiles that there can be

    Raises
    ------
    FileNotFoundError
        There is no surface.
    RunError
        It is one of an earlier version.
    """
    window = window_of(grid, bounds)
    rows, cols = grid.slices(window)
    variables = _kept(_Opened(store)).variables
    return window, {name: np.asarray(variables[name][..., rows, cols]) for name in names}


def chunks_over(store: StoreLike, grid: Grid, bounds: Bounds, names: Sequence[str] = tuple(LAYERS)) -> list[str]:
    """Paths inside the store of the chunks that `read_layers` reads, whether they were written or not. Raises as it does."""
    rows, cols = grid.slices(window_of(grid, bounds))
    surface = _kept(_Opened(store))
    tile, variables = int(surface.attrs["chunk_cells"]), surface.variables
    places = [
        f"{row}/{col}"
        for row in range(rows.start // tile, -(-rows.stop // tile))
        for col in range(cols.start // tile, -(-cols.stop // tile))
    ]
    return [f"{name}/c/{'0/' * (variables[name].ndim - 2)}{place}" for name in names for place in places]


def chunked_surface(store: StoreLike) -> xr.Dataset:
    """The survey's part of the layers: Dask arrays with one chunk per ground tile, coordinates, and the CRS (`.rio.crs`).

    Raises
    ------
    FileNotFoundError
        There is no surface.
    RunError
        It is one of an earlier version.
    """
    import rioxarray  # noqa: F401 - gives arrays their `.rio`

    whole = _dataset(store)
    lattice, grid = _grids(whole)
    rows, cols = lattice.slices(grid)
    tile = int(whole.attrs["chunk_cells"])
    part = whole.isel(y=rows, x=cols).chunk(y=tile, x=tile)
    placed = part.assign_coords(y=("y", grid.y_centres(), _axis("y")), x=("x", grid.x_centres(), _axis("x")))
    placed[CRS_VARIABLE].attrs.pop("GeoTransform")  # that of the whole lattice
    return placed


def grids_of(store: StoreLike) -> tuple[Grid, Grid]:
    """The grid of all tiles that there can be, and that of the survey. Raises as `chunked_surface`."""
    return _grids(_kept(_Opened(store)))


def _grids(surface: xr.Dataset) -> tuple[Grid, Grid]:
    about = surface.attrs
    x_min, y_max, rows, cols = about["lattice"]
    own = Grid(about["x_min"], about["y_max"], about["cell"], about["rows"], about["cols"])
    return Grid(x_min, y_max, about["cell"], rows, cols), own


def _axis(name: str) -> dict[str, str]:
    return {
        "standard_name": f"projection_{name}_coordinate", "long_name": f"{name} coordinate of cell centres", "units": "m", "axis": name.upper()
    }  # fmt: skip


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
    """Changes when the arrays are made anew, for another cell or tile, in a process that goes on."""
    if isinstance(store, str):
        found = os.stat(f"{store}/zarr.json")
        return found.st_mtime_ns, found.st_size, found.st_ino
    group = zarr.open_group(store, mode="r", zarr_format=3)
    return str(store.fs.to_json()), str(group.metadata)


def _dataset(store: StoreLike) -> xr.Dataset:
    import xarray as xr  # only where a surface is read: it takes half a second, and brings pandas

    found = xr.open_dataset(
        store, engine="zarr", chunks=None, mask_and_scale=False, decode_times=False, decode_coords="all", cache=False
    )
    if "lattice" not in found.attrs:
        raise RunError(
            "surface.zarr is of an earlier version, whose arrays end with the survey", where=str(store),
            remedy="repeat the command of the run (cityflow run … --out RUN): it makes the surfaces again",
        )  # fmt: skip
    return found
