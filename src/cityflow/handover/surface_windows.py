"""Windows of the surfaces of a run, for tasks: what they read is what was written, or they leave no record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from cityflow.core.grid import Bounds, Grid
from cityflow.flow.store import Store
from cityflow.io.rasters.surface_dataset import chunks_over, read_layers
from cityflow.io.rasters.surface_zarr import LAYERS


def read_windows(
    store: Store, zarr: str, grid: Grid, bounds: Bounds, names: Sequence[str] = tuple(LAYERS)
) -> tuple[Grid, dict[str, NDArray[Any]]]:
    """As `io.rasters.surface_dataset.read_layers`, of a Zarr group of the run; its chunks are held against what their tasks have written.

    Raises
    ------
    DamagedFileError
        A chunk is gone, or is not what was written.
    FileNotFoundError, RunError
        As `read_layers`.
    """
    place: Any = store.zarr_store(zarr)
    if store.expected is not None and store.is_local:
        store.check_once(f"{zarr}/{path}" for path in chunks_over(place, grid, bounds, names))
    return read_layers(place, grid, bounds, names)
