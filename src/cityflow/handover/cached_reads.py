"""Cached reads of files of earlier tasks, per process: units of one tile need the same point files, rasters and images."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from cityflow.core.grid import Bounds, Grid
from cityflow.core.points import PointCloud, concatenate
from cityflow.flow.store import Store
from cityflow.handover.image_copies import image_copies
from cityflow.handover.surface_windows import read_windows
from cityflow.io.images.tiled_images import TiledImage, open_image
from cityflow.io.points import las

PIECES_KEPT = 24
"""Decoded pieces a process keeps: at 15 points per m² and cells of 50 m some 40,000 points or 1.2 MB each."""

TEXTS_KEPT = 8
"""In memory, as are the next; no result depends on it."""
IMAGES_KEPT = 16
"""Images whose pieces are kept open."""


def read_points(store: Store, paths: Sequence[str], bounds: Bounds | None = None) -> PointCloud:
    """The points of index pieces, limited to `bounds`; pieces are immutable, so those read lately are kept."""
    clouds = [_piece(store, path) for path in paths]
    return concatenate([c if bounds is None else c.within(bounds) for c in clouds])


def read_surface(store: Store, zarr: str, city: Grid, bounds: Bounds) -> tuple[Grid, dict[str, np.ndarray]]:
    """Layers of one of the run's surfaces over `bounds`: float heights with NaN where there is none."""
    return read_windows(store, zarr, city, bounds, ("dsm", "dtm", "ndsm", "class"))


@lru_cache(maxsize=IMAGES_KEPT)
def open_pixels(store: Store, path: str) -> TiledImage:
    """An ingested image, read by window; of a remote store its copy."""
    if not store.is_local:
        return image_copies().open(store, path)
    with store.local_copy(path) as file:
        return open_image(file)


@lru_cache(maxsize=TEXTS_KEPT)
def read_text(store: Store, path: str) -> bytes:
    """A file of outline lines."""
    return store.read_bytes(path)


@lru_cache(maxsize=PIECES_KEPT)
def _piece(store: Store, path: str) -> PointCloud:
    with store.local_copy(path, whole=True) as local:
        return las.read_points(local)
