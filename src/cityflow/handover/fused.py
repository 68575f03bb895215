"""The fused surface of a ground tile as a file."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from cityflow.core.grid import Grid
from cityflow.flow.store import Store
from cityflow.handover.array_file import decode_arrays, encode_arrays
from cityflow.surface.fuse import Fused
from cityflow.surface.fused_tile import FusedTile

FUSED = "fused.cfa"
UNMATCHED = "without the depths of {}"


def encode_fused(tile: FusedTile) -> bytes:
    """What `read_fused` reads."""
    grid, surface = tile.grid, tile.surface
    attributes = {"x_min": grid.x_min, "y_max": grid.y_max, "cell": grid.cell, "factor": tile.factor}
    arrays: dict[str, NDArray[Any]] = {
        "dsm": surface.dsm, "count": surface.count, "sigma": surface.sigma, "filled": tile.filled, "colour": tile.colour,
    }  # fmt: skip
    return encode_arrays(arrays, attributes)


def read_fused(store: Store, path: str) -> FusedTile:
    """What a fuse task wrote."""
    arrays, attributes = decode_arrays(store.read_bytes(path))
    grid = Grid(attributes["x_min"], attributes["y_max"], attributes["cell"], *arrays["dsm"].shape)
    surface = Fused(grid, arrays["dsm"], arrays["count"], arrays["sigma"])
    return FusedTile(surface, arrays["filled"], attributes["factor"], arrays["colour"])
