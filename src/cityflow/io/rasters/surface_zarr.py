"""``surface.zarr``: the rasters of a run as one Zarr v3 group, one chunk per ground tile, for xarray and rioxarray.

The driver creates the arrays once; after that every tile writes its own chunk of each layer and no other. Arrays reach over the whole
lattice of tiles (`core.grid.lattice_grid`), so the chunk of a tile is the same for any survey, and only chunks that were written take room.
Where the survey stands in them is an attribute: it grows in any direction without touching a chunk. A coordinate of every cell would take
gigabytes, so `surface_dataset` makes those of the survey.
"""

from __future__ import annotations

import base64
import struct
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import zarr
from numpy.typing import DTypeLike, NDArray
from zarr.codecs import BloscCodec
from zarr.errors import ContainsArrayError, GroupNotFoundError

from cityflow.core.grid import Bounds, Grid
from cityflow.core.points import BRIDGE, BUILDING, GROUND, HIGH_VEGETATION, UNCLASSIFIED, WATER
from cityflow.core.reference import Reference
from cityflow.errors import RunError
from cityflow.io.crs import crs_of, vertical_datum

StoreLike = Any
"""A local path, or a zarr ``Store`` such as ``FsspecStore``."""

CRS_VARIABLE = "spatial_ref"
_NAN_AS_XARRAY_WRITES_IT = base64.b64encode(struct.pack("<d", float("nan"))).decode()


@dataclass(frozen=True, slots=True)
class Layer:
    """One raster: dtype, the value of cells never written, what it says; `bands` > 0 makes it (bands, rows, cols); `standard_name` is of CF."""

    dtype: str
    fill: float | int | bool
    meaning: str
    units: str = ""
    bands: int = 0
    standard_name: str = ""


LAYERS: Mapping[str, Layer] = {
    "dsm": Layer("float32", float("nan"), "highest surface, as measured", "m", 0, "altitude"),
    "dsm_filled": Layer("float32", float("nan"), "highest surface, small gaps filled", "m", 0, "altitude"),
    "dtm": Layer("float32", float("nan"), "terrain", "m", 0, "surface_altitude"),
    "ndsm": Layer("float32", float("nan"), "surface above terrain", "m", 0, "height"),
    "class": Layer("uint8", 0, "ASPRS class of the cell"),
    "count": Layer("uint32", 0, "points in the cell"),
    "holes": Layer("bool", True, "no measurement, not even interpolated"),
}

CLASSES: Mapping[int, str] = {
    0: "unknown", UNCLASSIFIED: "unclassified", GROUND: "ground", HIGH_VEGETATION: "high_vegetation", BUILDING: "building", WATER: "water",
    BRIDGE: "bridge",
}  # fmt: skip
"""Values of the layer ``class`` and what CF's flags call them."""

SEEN = Layer("bool", False, "some image sees the cell, so that the ortho has a colour")
SIGMA = Layer("float32", float("nan"), "expected standard deviation of the dsm", "m")


def image_layers(bands: int, dtype: str) -> dict[str, Layer]:
    """Layers of a surface from images on the cell of the images: the usual ones, precision, and the true ortho."""
    return {**LAYERS, "sigma": SIGMA, "ortho": Layer(dtype, 0, "true ortho", bands=bands), "ortho_seen": SEEN}


def frame_layers(bands: int, dtype: str) -> dict[str, Layer]:
    """Layers of the local reference frame of a cluster of oblique views; heights count towards the cameras."""
    kept = {name: LAYERS[name] for name in ("dsm", "dsm_filled", "count", "holes")}
    return {**kept, "sigma": SIGMA, "ortho": Layer(dtype, 0, "true oblique ortho", bands=bands), "ortho_seen": SEEN}


def create(
    store: StoreLike,
    grid: Grid,
    chunk_cells: int,
    reference: Reference,
    layers: Mapping[str, Layer] = LAYERS,
    replace: bool = False,
    *,
    extent: Grid | None = None,
) -> bool:
    """Make the group and its empty arrays unless they are there already; True where something was made.

    Parameters
    ----------
    grid : of all tiles that there can be;  chunk_cells : edge of a tile in cells
    replace : start anew where the arrays there have another grid, chunk or CRS
    extent : the part where the survey stands, that whoever opens the store is shown; noted anew where it has grown. All without it

    Raises
    ------
    RunError
        Such arrays are there, and `replace` is not set.
    """
    rows, cols = grid.slices(extent or grid)
    described: dict[str, Any] = {
        "lattice": [grid.x_min, grid.y_max, grid.rows, grid.cols], "cell": grid.cell, "chunk_cells": chunk_cells, "crs": reference.code,
        "vertical_datum": vertical_datum(reference),
    }  # fmt: skip
    shown = extent or grid
    place: dict[str, Any] = {
        "x_min": shown.x_min, "y_max": shown.y_max, "row": rows.start, "rows": shown.rows, "col": cols.start, "cols": shown.cols
    }  # fmt: skip
    found = _attributes(store)
    if found is not None and not _has(found, described) and not replace:
        raise RunError(
            "surface.zarr was made for another lattice, cell, tile or CRS",
            where=str(store),
            remedy="use another RUN folder, or remove surface.zarr",
        )
    fresh = found is None or not _has(found, described)
    group = zarr.open_group(store, mode="w" if fresh else "a", zarr_format=3, use_consolidated=False)
    bands = max(layer.bands for layer in layers.values())
    made = [_crs_variable(group, grid, reference)]
    made += [_bands(group, bands)] if bands else []
    made += [_layer(group, name, layer, grid, chunk_cells) for name, layer in layers.items()]
    if fresh or any(made) or not _has(found or {}, place):
        group.attrs.update({**described, **place})
        _consolidate(group)
    return fresh or any(made)


def _has(attributes: Mapping[str, Any], wanted: Mapping[str, Any]) -> bool:
    return all(attributes.get(key) == value for key, value in wanted.items())


def create_group(store: StoreLike) -> None:
    """An empty group, for other groups to stand in."""
    zarr.open_group(store, mode="a", zarr_format=3, use_consolidated=False)


def write_tile(store: StoreLike, grid: Grid, tile: Grid, layers: Mapping[str, NDArray[Any]]) -> list[str]:
    """Write one tile's chunks of each of `layers`, each ([bands,] rows, cols) of `tile`; `grid` is that of all tiles that there can be. Returns the
    paths of the chunks inside the store.

    Raises
    ------
    ValueError
        The tile is not made of whole chunks, or a layer has another shape: two tasks could write one chunk.
    """
    rows, cols = grid.slices(tile)
    group, paths = _open(store, "r+"), list[str]()
    for name, layer in layers.items():
        array: Any = group[name]
        height, width = array.chunks[-2:]
        if (
            layer.shape[-2:] != tile.shape
            or layer.shape[:-2] != array.shape[:-2]
            or rows.start % height
            or cols.start % width
            or tile.rows % height
            or tile.cols % width
        ):
            raise ValueError(f"layer {name} of shape {layer.shape} over {tile} is not made of chunks of {array.chunks}")
        array[..., rows, cols] = layer.astype(array.dtype, copy=False)
        paths += chunk_paths(grid, tile, {name: layer}, height)
    return paths


def chunk_paths(grid: Grid, tile: Grid, layers: Mapping[str, NDArray[Any]], chunk_cells: int) -> list[str]:
    """Paths inside the store of the chunks that `write_tile` writes, layer by layer."""
    rows, cols = (range(s.start // chunk_cells, s.stop // chunk_cells) for s in grid.slices(tile))
    places = [f"{row}/{col}" for row in rows for col in cols]
    return [f"{name}/c/{'0/' * (layer.ndim - 2)}{place}" for name, layer in layers.items() for place in places]


def window_of(grid: Grid, bounds: Bounds) -> Grid:
    """The cells of `grid` that `bounds` touch. Raises ValueError where there are none.

    >>> window_of(Grid(0.0, 10.0, 1.0, 10, 10), (-5.0, 8.5, 1.5, 20.0))
    Grid(x_min=0.0, y_max=10.0, cell=1.0, rows=2, cols=2)
    """
    touched = Grid.covering(bounds, grid.cell)
    x_min, y_min, x_max, y_max = grid.bounds
    inner = touched.bounds
    left, right = max(inner[0], x_min), min(inner[2], x_max)
    low, high = max(inner[1], y_min), min(inner[3], y_max)
    rows, cols = round((high - low) / grid.cell), round((right - left) / grid.cell)
    if rows < 1 or cols < 1:
        raise ValueError(f"bounds {bounds} do not meet the surface {grid.bounds}")
    return Grid(left, high, grid.cell, rows, cols)


def _open(store: StoreLike, mode: Literal["r", "r+"]) -> zarr.Group:
    # a chunk of nothing but fill values is written too: a missing chunk means a tile not done
    zarr.config.set({"array.write_empty_chunks": True})
    return zarr.open_group(store, mode=mode, zarr_format=3)


def _consolidate(group: zarr.Group) -> None:
    """Put the metadata of all arrays beside the group's, so that one request opens everything."""
    with warnings.catch_warnings():
        # zarr warns that the specification does not have this yet; readers that do not know it read the arrays' own
        warnings.filterwarnings("ignore", message="Consolidated metadata", category=UserWarning)
        zarr.consolidate_metadata(group.store_path.store, path=group.path, zarr_format=3)


def _attributes(store: StoreLike) -> dict[str, Any] | None:
    try:
        return zarr.open_group(store, mode="r", zarr_format=3).attrs.asdict()
    except (FileNotFoundError, GroupNotFoundError):
        return None


def _layer(group: zarr.Group, name: str, layer: Layer, grid: Grid, chunk_cells: int) -> bool:
    attributes: dict[str, Any] = {"long_name": layer.meaning, "grid_mapping": CRS_VARIABLE, "coordinates": CRS_VARIABLE}
    if layer.units:
        attributes["units"] = layer.units
    if layer.standard_name:
        attributes["standard_name"] = layer.standard_name
    if name == "class":
        attributes |= {"flag_values": list(CLASSES), "flag_meanings": " ".join(CLASSES.values())}
    if layer.dtype.startswith("float"):
        attributes["_FillValue"] = _NAN_AS_XARRAY_WRITES_IT
    bands = (layer.bands,) if layer.bands else ()
    shape, chunks = (*bands, *grid.shape), (*bands, chunk_cells, chunk_cells)
    dimensions = ("band", "y", "x") if bands else ("y", "x")
    return _array(group, name, shape, chunks, layer.dtype, layer.fill, attributes, dimensions)


def _bands(group: zarr.Group, count: int) -> bool:
    """Bands count from 1, as in GeoTIFF."""
    attributes = {"long_name": "red, green, blue, near infrared" if count > 1 else "grey"}
    if not _array(group, "band", (count,), (count,), "int32", 0, attributes, ("band",)):
        return False
    array: Any = group["band"]
    array[:] = np.arange(1, count + 1)
    return True


def _crs_variable(group: zarr.Group, grid: Grid, reference: Reference) -> bool:
    crs = crs_of(reference)
    a, b, c, d, e, f = grid.transform
    attributes: dict[str, Any] = {"GeoTransform": f"{c!r} {a!r} {b!r} {f!r} {d!r} {e!r}"}
    if crs is not None:
        attributes |= {"crs_wkt": crs.to_wkt(), "spatial_ref": crs.to_wkt()}
    return _array(group, CRS_VARIABLE, (), (), "int32", 0, attributes, ())


def _array(
    group: zarr.Group,
    name: str,
    shape: tuple[int, ...],
    chunks: tuple[int, ...],
    dtype: DTypeLike,
    fill: float | int | bool,
    attributes: dict[str, Any],
    dimensions: tuple[str, ...],
) -> bool:
    try:
        group.create_array(
            name,
            shape=shape,
            chunks=chunks,
            dtype=dtype,
            fill_value=fill,
            attributes=attributes,
            dimension_names=dimensions,
            compressors=BloscCodec(cname="lz4", clevel=5),
        )
    except ContainsArrayError:
        return False
    return True
