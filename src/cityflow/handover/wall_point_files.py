"""Points on façades as a file: written for a ground tile, read within bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Bounds
from cityflow.flow.store import Store
from cityflow.handover.array_file import decode_arrays, encode_arrays


def encode_walls(found: WallPoints) -> bytes:
    """What `read_walls` reads."""
    arrays: dict[str, NDArray[Any]] = {
        "xyz": found.xyz,
        "normal": found.normal,
        "sigma": found.sigma,
        "views": found.views,
    }
    return encode_arrays(arrays, {})


def read_walls(store: Store, paths: Sequence[str], bounds: Bounds) -> WallPoints:
    """What walls tasks wrote, within bounds, in the order of the paths."""
    parts = []
    for path in paths:
        arrays, _ = decode_arrays(store.read_bytes(path))
        parts.append(WallPoints(arrays["xyz"], arrays["normal"], arrays["sigma"], arrays["views"]).within(bounds))
    return joined_walls(parts)
