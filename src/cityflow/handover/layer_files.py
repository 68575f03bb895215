"""Shared by the stages surface, ortho and frame: storing layers in their chunks with a digest, and rasters as products."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import FloatArray
from cityflow.core.colour_image import COLOURS
from cityflow.core.grid import Grid
from cityflow.core.reference import Reference
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.io.crs import resolve
from cityflow.io.rasters.raster import read_window, write_cog
from cityflow.io.rasters.raster_header import read_raster_header
from cityflow.io.rasters.raster_white import WHITE, white_of_raster
from cityflow.io.rasters.remote_raster import raster_file
from cityflow.io.rasters.surface_zarr import write_tile
from cityflow.surface.true_ortho import Ortho


@dataclass(frozen=True, slots=True)
class GivenOrtho(TaskInputs):
    """An ortho that the catalog names: its kind there, its address, its cell in metres."""

    kind: str
    href: str
    cell_m: float


def store_layers(workspace: Workspace, zarr: str, whole: Grid, grid: Grid, layers: Mapping[str, NDArray[Any]]) -> str:
    """Write a tile's chunks of each layer; the digest of the layers themselves, however the store compresses them.

    Parameters
    ----------
    whole : the grid of all tiles that there can be;  grid : of the tile
    """
    digest = _digest(layers)
    for path in write_tile(workspace.store.zarr_store(zarr), whole, grid, layers):
        workspace.note(f"{zarr}/{path}", digest)
    return digest


def store_ortho(workspace: Workspace, zarr: str, whole: Grid, grid: Grid, made: Ortho) -> str:
    """The tile's chunk of the layers ``ortho`` and ``ortho_seen``."""
    # OpenCV parts colours far faster than numpy
    colour = np.stack(cv2.split(made.colour)) if made.colour.size else np.moveaxis(made.colour, -1, 0)
    return store_layers(workspace, zarr, whole, grid, {"ortho": colour, "ortho_seen": made.mask})


def publish_rasters(workspace: Workspace, tile: str, crs: str, grid: Grid, rasters: Mapping[str, NDArray[Any]]) -> None:
    """GeoTIFFs of a tile, a folder for each kind."""
    reference = resolve(crs)
    for name, raster in rasters.items():
        workspace.publish(f"products/{name}/{tile}.tif", write_cog(raster, grid, reference))


def given_dtm(href: str | None, crs: str, grid: Grid) -> FloatArray | None:
    """The catalog's terrain on `grid`, where it has one."""
    if href is None:
        return None
    with raster_file(href) as path:
        return read_window(path, grid, resolve(crs))


def given_colours(path: str | Path, grid: Grid, reference: Reference, resampling: str = "bilinear") -> FloatArray:
    """(3, rows, cols) red, green and blue of an orthophoto on `grid`, 0 to 255 whatever its depth; a grey one three times; NaN where it has nothing."""
    header = read_raster_header(path)
    wanted = (1, 2, 3) if header.bands >= COLOURS else (1, 1, 1)
    bands = np.stack([read_window(path, grid, reference, band=b, resampling=resampling) for b in wanted])
    return np.asarray(bands if header.dtype == "uint8" else bands * (WHITE / white_of_raster(path)))


def _digest(layers: Mapping[str, NDArray[Any]]) -> str:
    digest = hashlib.sha256()
    for name, layer in sorted(layers.items()):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(layer).data.cast("B") if layer.size else b"")
    return digest.hexdigest()
