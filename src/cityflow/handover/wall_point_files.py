"""Points on façades, and points under something higher, as a file: written for a ground tile, read within bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Bounds
from cityflow.flow.store import Store
from cityflow.handover.array_file import decode_arrays, encode_arrays

COVERED = "covered"


def encode_walls(found: WallPoints, covered: FloatArray) -> bytes:
    """What `read_walls` and `read_covered` read; `covered` is (M, 3), world metres."""
    arrays: dict[str, NDArray[Any]] = {
        "xyz": found.xyz,
        "normal": found.normal,
        "sigma": found.sigma,
        "views": found.views,
        COVERED: covered,
    }
    return encode_arrays(arrays, {})


def read_walls(store: Store, paths: Sequence[str], bounds: Bounds) -> WallPoints:
    """What walls tasks wrote, within bounds, in the order of the paths."""
    parts = []
    for path in paths:
        arrays, _ = decode_arrays(store.read_bytes(path), lambda name: name != COVERED)
        parts.append(WallPoints(arrays["xyz"], arrays["normal"], arrays["sigma"], arrays["views"]).within(bounds))
    return joined_walls(parts)


def read_covered(store: Store, paths: Sequence[str], bounds: Bounds) -> FloatArray:
    """(M, 3) covered points within bounds, in the order of the paths."""
    parts = [np.empty((0, 3))]
    for path in paths:
        arrays, _ = decode_arrays(store.read_bytes(path), lambda name: name == COVERED)
        parts.append(arrays[COVERED])
    xyz = np.concatenate(parts)
    x, y = xyz[:, 0], xyz[:, 1]
    return np.asarray(xyz[(x >= bounds[0]) & (x < bounds[2]) & (y >= bounds[1]) & (y < bounds[3])])
