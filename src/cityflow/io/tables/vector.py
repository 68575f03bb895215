"""Outlines and areas from any vector format of GDAL, with all attributes."""

from __future__ import annotations

import datetime
import json
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Scalar
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import contradiction, horizontal_transform, looks_like_degrees, suspicion, transformed
from cityflow.io.fetch import local_file

POLYGON, MULTIPOLYGON = 3, 6
"""shapely's type ids."""
NO_GEOMETRY = "no geometry"
ROWS = 20_000
"""Of a large file that are in memory at a time."""
FORMATS_REMEDY = "give polygons as GeoPackage, GeoJSON, Shapefile or another format that GDAL reads"


@dataclass(frozen=True, slots=True)
class Layer:
    """One layer as the file has it.

    Attributes
    ----------
    path, name : the file and the layer in it
    crs : the file's own, None where it states none
    geometry : (N,) shapely geometries, None where null
    columns : attribute name → N values as JSON scalars
    endless : row → a coordinate of it that is no finite number; such a geometry is null here
    """

    path: str
    name: str
    crs: CRS | None
    geometry: NDArray[np.object_]
    columns: Mapping[str, list[Scalar]]
    endless: Mapping[int, float] = field(default_factory=dict)

    @property
    def bounds(self) -> Bounds:
        """Of all finite coordinates; NaN where there is none."""
        xy = shapely.get_coordinates(self.geometry)
        xy = xy[np.isfinite(xy).all(axis=1)]
        if not len(xy):
            return math.nan, math.nan, math.nan, math.nan
        (x_min, y_min), (x_max, y_max) = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
        return x_min, y_min, x_max, y_max


def read_layer(path: str | Path, layer: str | None = None) -> Layer:
    """One layer of a local or remote vector file.

    Raises
    ------
    CatalogError
        Where the file is missing or unreadable, the layer is unknown, or several exist and none is named.
    """
    # brings pandas along: a second and 60 MB in every process, most of which read no vector file
    import pyogrio

    with _opened(path, layer) as (source, chosen):
        meta, table = pyogrio.read_arrow(source, layer=chosen)
    return _as_layer(str(path), chosen, meta, table)


def parts_of_layer(path: str | Path, layer: str | None) -> Iterator[Layer]:
    """The same layer, so many rows at a time. Raises as `read_layer`."""
    import pyogrio

    with (
        _opened(path, layer) as (source, chosen),
        pyogrio.open_arrow(source, layer=chosen, batch_size=ROWS, use_pyarrow=True) as (meta, batches),
    ):
        for batch in batches:
            yield _as_layer(str(path), chosen, meta, batch)


@contextmanager
def _opened(path: str | Path, layer: str | None) -> Iterator[tuple[str, str]]:
    """The local file, and the layer to read."""
    import pyogrio
    from pyogrio.errors import DataLayerError, DataSourceError

    name = str(path)
    try:
        with local_file(name) as source:
            layers = [str(row[0]) for row in pyogrio.list_layers(source) if row[1] is not None]
            yield str(source), _chosen_layer(name, layers, layer)
    except (DataSourceError, DataLayerError) as error:
        raise CatalogError(f"this vector file cannot be read ({error})", where=name, remedy=FORMATS_REMEDY) from error


def _as_layer(path: str, name: str, meta: Mapping[str, Any], table: Any) -> Layer:
    geometry_column = meta["geometry_name"] or "wkb_geometry"
    try:
        with np.errstate(invalid="ignore"):
            geometry = shapely.from_wkb(table.column(geometry_column).to_numpy(zero_copy_only=False), on_invalid="fix")
    except shapely.errors.GEOSException as error:
        remedy = "look for coordinates that are no numbers, and for rings that do not end where they begin"
        raise CatalogError(f"a geometry in it cannot be read ({error})", where=path, remedy=remedy) from error
    names = [c for c in table.schema.names if c != geometry_column]
    columns = {c: [_scalar(v) for v in table.column(c).to_pylist()] for c in names}
    flat = np.asarray(shapely.force_2d(geometry), object)
    endless = _endless(flat)
    flat[list(endless)] = None
    return Layer(path, name, _crs(meta["crs"], path), flat, columns, endless)


def _endless(geometry: NDArray[np.object_]) -> dict[int, float]:
    """Rows of geometries with a coordinate that is no finite number, and the first such coordinate."""
    xy, of = shapely.get_coordinates(geometry, return_index=True)
    bad = ~np.isfinite(xy)
    rows, first = np.unique(of[bad.any(axis=1)], return_index=True)
    values = np.where(bad[:, 0], xy[:, 0], xy[:, 1])[bad.any(axis=1)]
    return dict(zip(rows.tolist(), values[first].tolist(), strict=True))


def _chosen_layer(path: str, layers: list[str], wanted: str | None) -> str:
    if not layers:
        raise CatalogError("the file has no layer with geometries", where=path, remedy=FORMATS_REMEDY)
    if wanted is not None and wanted not in layers:
        raise CatalogError(f"no layer {wanted!r}", where=path, remedy=f"choose one of: {', '.join(layers)}")
    if wanted is None and len(layers) > 1:
        raise CatalogError(
            f"the file has {len(layers)} layers", where=path, remedy=f"name one of them: {', '.join(layers)}"
        )
    return wanted or layers[0]


def _crs(text: str | None, path: str) -> CRS | None:
    if not text:
        return None
    try:
        crs = CRS.from_user_input(text)
    except CRSError as error:
        raise CatalogError(
            f"its CRS cannot be read ({error})", where=path, remedy="reproject the file to the CRS of the catalog"
        ) from error
    # GeoPackage's "undefined" systems arrive as engineering or nameless CRS.
    return None if crs.is_engineering or crs.name.lower().startswith(("undefined", "unknown")) else crs


def _scalar(value: Any) -> Scalar:
    """A JSON scalar: dates as ISO 8601, missing and not-a-number as None, lists as JSON text."""
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float | Decimal):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    if isinstance(value, bytes):
        return value.hex()
    return json.dumps(value, default=str, sort_keys=True, ensure_ascii=False)


def read_polygons(path: str | Path, target: Reference, layer: str | None = None) -> list[Polygon]:
    """Polygons in the world frame, without attributes; multipolygons come apart, what is empty is left out.

    Raises as `read_outlines`.
    """
    source = read_layer(path, layer)
    if not np.isin(shapely.get_type_id(source.geometry), (POLYGON, MULTIPOLYGON)).any():
        problem = f"no polygon in layer {source.name!r}; it holds {listed_kinds(kinds_of(source.geometry))}"
        raise CatalogError(problem, where=source.path, remedy="name a layer or a file of polygons")
    parts = shapely.get_parts(to_reference(source, target)[0])
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]


def kinds_of(geometry: NDArray[np.object_]) -> Counter[str]:
    """How many there are of each type of geometry."""
    return Counter(NO_GEOMETRY if g is None else g.geom_type for g in geometry)


def listed_kinds(kinds: Mapping[str, int]) -> str:
    """The same as a text."""
    return ", ".join(f"{n} × {kind}" for kind, n in sorted(kinds.items())) or "nothing"


def to_reference(source: Layer, target: Reference) -> tuple[NDArray[np.object_], list[str]]:
    """The layer's geometries in the world frame, and notes on how they came there.

    Raises
    ------
    CatalogError
        Where the coordinates cannot be those of the CRS that the file states, or of the catalog where it states none.
    """
    move, notes = placing(source.path, source.crs, source.bounds, target)
    return (source.geometry if move is None else shapely.transform(source.geometry, move)), notes


def placing(
    path: str, crs: CRS | None, bounds: Bounds, target: Reference
) -> tuple[Callable[[FloatArray], FloatArray] | None, list[str]]:
    """How coordinates (N, 2) of a file within `bounds` come into the world frame, None where they are in it, and notes. Raises as `to_reference`."""
    if not np.isfinite(bounds).all():
        raise CatalogError("no coordinate is a finite number", where=path, remedy="export the file again")
    if crs is not None and crs.is_geographic and not looks_like_degrees(bounds):
        # GeoJSON has no way to say anything but WGS 84, so software writes metres under that name.
        return None, [_assumed(path, bounds, target, f"states {crs.name} but its coordinates are no degrees")]
    if crs is None:
        return None, [_assumed(path, bounds, target, "states no CRS")]
    if target.is_local:
        if crs.is_geographic:
            problem = f"outlines in {crs.name} cannot be placed in a local frame"
            raise CatalogError(problem, where=path, remedy="assign a CRS with --crs EPSG:n")
        return None, [f"{Path(path).name} states {crs.name}; taken as coordinates of the local frame"]
    if not contradiction(target, crs):
        return None, []
    transformer = horizontal_transform(crs, target)
    return lambda xy: transformed(transformer, xy), [
        f"{Path(path).name} was reprojected from {crs.name} to {target.name} ({transformer.description})"
    ]


def _assumed(path: str, bounds: Bounds, target: Reference, why: str) -> str:
    doubt = suspicion(target, bounds)
    if doubt:
        raise CatalogError(f"the file {why}, and {doubt}", where=path, remedy="store the file with its CRS")
    return f"{Path(path).name} {why}; {target.name} is assumed, as the catalog says"
