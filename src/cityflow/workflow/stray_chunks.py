"""Removes the chunks of ground tiles that a survey has no more."""

from __future__ import annotations

from cityflow.core.grid import FARTHEST_TILE
from cityflow.flow.store import Store
from cityflow.survey.surface_source import ZARR
from cityflow.survey.survey import Survey

EVERY_TILE_HAS = "dsm"
"""The layer that is looked through; the last one to go."""


def remove_strays(store: Store, survey: Survey) -> int:
    """Returns how many tiles have gone: whoever looks over a border must not see what none of its inputs is."""
    known = {f"{FARTHEST_TILE - 1 - t.row}/{FARTHEST_TILE + t.col}" for t in survey.lattice.tiles.values()}
    gone: set[str] = set()
    for group in dict.fromkeys((survey.source.zarr, ZARR)):
        folder = f"{group}/{EVERY_TILE_HAS}/c/"
        strays = {path.removeprefix(folder) for path in store.find(folder[:-1])} - known
        layers = [name for name in store.folders(group) if name != EVERY_TILE_HAS] if strays else []
        for layer in (*layers, EVERY_TILE_HAS) if strays else ():
            bands = "0/" if store.folders(f"{group}/{layer}/c") == ["0"] else ""
            store.remove_files([f"{group}/{layer}/c/{bands}{place}" for place in sorted(strays)])
        gone |= strays
    return len(gone)
