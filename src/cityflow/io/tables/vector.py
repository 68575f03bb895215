"""Outlines and areas from any vector format of GDAL, with all attributes."""

from __future__ import annotations

import datetime
import json
import math
from collections import Counter
from collections.abc import Mapping
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

from cityflow.core.building import Outline, Scalar
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import contradiction, horizontal_transform, looks_like_degrees, suspicion, transformed
from cityflow.io.fetch import local_file
from cityflow.io.tables.feature_ids import ids_of, listing, notes_on_ids

POLYGON, MULTIPOLYGON = 3, 6
"""shapely's type ids."""
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
    from pyogrio.errors import DataLayerError, DataSourceError

    name = str(path)
    try:
        with local_file(name) as source:
            layers = [str(row[0]) for row in pyogrio.list_layers(source) if row[1] is not None]
            chosen = _chosen_layer(name, layers, layer)
            meta, table = pyogrio.read_arrow(source, layer=chosen)
    except (DataSourceError, DataLayerError) as error:
        raise CatalogError(f"this vector file cannot be read ({error})", where=name, remedy=FORMATS_REMEDY) from error
    geometry_column = meta["geometry_name"] or "wkb_geometry"
    try:
        with np.errstate(invalid="ignore"):
            geometry = shapely.from_wkb(table.column(geometry_column).to_numpy(zero_copy_only=False), on_invalid="fix")
    except shapely.errors.GEOSException as error:
        remedy = "look for coordinates that are no numbers, and for rings that do not end where they begin"
        raise CatalogError(f"a geometry in it cannot be read ({error})", where=name, remedy=remedy) from error
    columns = {c: [_scalar(v) for v in table.column(c).to_pylist()] for c in table.column_names if c != geometry_column}
    flat = np.asarray(shapely.force_2d(geometry), object)
    endless = _endless(flat)
    flat[list(endless)] = None
    return Layer(name, chosen, _crs(meta["crs"], name), flat, columns, endless)


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


def read_outlines(
    path: str | Path, id_column: str | None, id_format: str | None, target: Reference, layer: str | None = None
) -> tuple[list[Outline], list[str]]:
    """Building outlines in the world frame, one per feature and in the file's order.

    Nothing is repaired or left out here: a multipolygon stays one, a missing geometry becomes an empty polygon, so that
    cleaning (`outlines.given.given`) can account for every feature.

    Parameters
    ----------
    id_column : column that holds the ids; None leaves them empty
    id_format : Python format of an id, such as ``{:016d}`` or ``house-{}``; None takes values as they are
    target : reference of the result; another CRS is reprojected to it

    Returns
    -------
    outlines, notes : what was read, and what a user should know about it

    Raises
    ------
    CatalogError
        Where the file is unreadable, holds something else than polygons, or the id column or format does not fit.
    """
    source = read_layer(path, layer)
    _refuse_unless_polygons(source)
    ids = ids_of(source, id_column, id_format)
    geometry, notes = to_reference(source, target)
    notes += notes_on_ids(ids) if id_column is not None else []
    notes += _notes_on_geometry(geometry, ids, source.endless)
    rows = [dict(zip(source.columns, values, strict=True)) for values in zip(*source.columns.values(), strict=True)]
    rows = rows or [{} for _ in geometry]
    return [Outline(*of) for of in zip(ids, _polygons(geometry), rows, strict=True)], notes


def read_polygons(path: str | Path, target: Reference, layer: str | None = None) -> list[Polygon]:
    """Polygons in the world frame, without attributes; multipolygons come apart, what is empty is left out.

    Raises as `read_outlines`.
    """
    source = read_layer(path, layer)
    _refuse_unless_polygons(source)
    parts = shapely.get_parts(to_reference(source, target)[0])
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]


def _refuse_unless_polygons(source: Layer) -> None:
    if np.isin(shapely.get_type_id(source.geometry), (POLYGON, MULTIPOLYGON)).any():
        return
    found = _kinds(source.geometry)
    problem = f"no polygon in layer {source.name!r}; it holds {found}"
    raise CatalogError(problem, where=source.path, remedy="name a layer or a file of polygons")


def _kinds(geometry: NDArray[np.object_]) -> str:
    names = Counter("no geometry" if g is None else g.geom_type for g in geometry)
    return ", ".join(f"{n} × {kind}" for kind, n in sorted(names.items())) or "nothing"


def to_reference(source: Layer, target: Reference) -> tuple[NDArray[np.object_], list[str]]:
    """The layer's geometries in the world frame, and notes on how they came there.

    Raises
    ------
    CatalogError
        Where the coordinates cannot be those of the CRS that the file states, or of the catalog where it states none.
    """
    crs, bounds = source.crs, source.bounds
    if not np.isfinite(bounds).all():
        raise CatalogError("no coordinate is a finite number", where=source.path, remedy="export the file again")
    if crs is not None and crs.is_geographic and not looks_like_degrees(bounds):
        # GeoJSON has no way to say anything but WGS 84, so software writes metres under that name.
        return source.geometry, [_assumed(source, target, f"states {crs.name} but its coordinates are no degrees")]
    if crs is None:
        return source.geometry, [_assumed(source, target, "states no CRS")]
    if target.is_local:
        if crs.is_geographic:
            raise CatalogError(
                f"outlines in {crs.name} cannot be placed in a local frame",
                where=source.path,
                remedy="assign a CRS with --crs EPSG:n",
            )
        return source.geometry, [f"{Path(source.path).name} states {crs.name}; taken as coordinates of the local frame"]
    if not contradiction(target, crs):
        return source.geometry, []
    transformer = horizontal_transform(crs, target)
    moved = shapely.transform(source.geometry, lambda xy: transformed(transformer, xy))
    return moved, [
        f"{Path(source.path).name} was reprojected from {crs.name} to {target.name} ({transformer.description})"
    ]


def _assumed(source: Layer, target: Reference, why: str) -> str:
    doubt = suspicion(target, source.bounds)
    if doubt:
        raise CatalogError(f"the file {why}, and {doubt}", where=source.path, remedy="store the file with its CRS")
    return f"{Path(source.path).name} {why}; {target.name} is assumed, as the catalog says"


def _notes_on_geometry(geometry: NDArray[np.object_], ids: list[str], endless: Mapping[int, float]) -> list[str]:
    notes = []
    lost = np.flatnonzero(shapely.is_missing(geometry) | shapely.is_empty(geometry)).tolist()
    if endless:
        told = listing(f"{ids[i] or f'feature {i + 1}'}: {value}" for i, value in endless.items())
        notes.append(
            f"outlines with a coordinate that is no finite number: {len(endless)} ({told}); they count as empty"
        )
    if names := [ids[i] or f"feature {i + 1}" for i in lost if i not in endless]:
        notes.append(f"outlines without geometry: {len(names)} ({listing(names)})")
    kinds = shapely.get_type_id(geometry)
    wrong = ~np.isin(kinds, (POLYGON, MULTIPOLYGON)) & (kinds >= 0)
    if wrong.any():
        notes.append(f"outlines must be polygons; these are not: {_kinds(geometry[wrong])}")
    several = int(((kinds == MULTIPOLYGON) & (shapely.get_num_geometries(geometry) > 1)).sum())
    if several:
        notes.append(f"outlines of several parts: {several}; each part becomes a unit of its own")
    return notes


def _polygons(geometry: NDArray[np.object_]) -> list[Any]:
    """Exteriors counter-clockwise, a multipolygon of one part as that part, and an empty polygon for none."""
    single = (shapely.get_type_id(geometry) == MULTIPOLYGON) & (shapely.get_num_geometries(geometry) == 1)
    simple = np.where(single, shapely.get_geometry(geometry, 0), geometry)
    return [Polygon() if g is None else g for g in shapely.orient_polygons(simple)]
