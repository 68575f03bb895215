"""Tables of units as GeoParquet: of a tile with all attributes, of many tiles with the little that an index needs."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import shapely
from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Scalar
from cityflow.core.reference import Reference
from cityflow.io.crs import horizontal_crs
from cityflow.io.tables.geoparquet import geoparquet_bytes
from cityflow.io.tables.typed_columns import Row, columns_of

UNITS, INDEX = "units", "index"
"""Folders among the products."""
INDEXED = ("id", "tile", "status", "verdict")
OWN = (*INDEXED, "reason")
_RESERVED = (*OWN, "geometry", "bbox")


@dataclass(frozen=True, slots=True)
class UnitTable:
    """A table of units as it is read for an index: columns of `INDEXED`, and a geometry each."""

    table: pa.Table
    shapes: Sequence[BaseGeometry | None]


def write_units(rows: Sequence[Row], shapes: Sequence[BaseGeometry | None], reference: Reference) -> bytes:
    """Units with all attributes. Rows have the keys of `OWN`; a source's attribute that bears one of these names gets a number."""
    own = {name: pa.array([_text(row.get(name)) for row in rows], pa.string()) for name in OWN}
    others = columns_of([{k: v for k, v in row.items() if k not in OWN} for row in rows], _RESERVED)
    columns = own | {name: pa.array(values, mask=mask) for name, values, mask in others}
    return _written(pa.table(columns), shapes, reference)


def write_index(tables: Iterable[UnitTable], reference: Reference) -> bytes:
    """The index of several tables, one after the other."""
    found = list(tables)
    empty = pa.table({name: pa.array([], pa.string()) for name in INDEXED})
    table = pa.concat_tables([t.table for t in found]) if found else empty
    return _written(table, [shape for t in found for shape in t.shapes], reference)


def read_for_index(data: bytes) -> UnitTable:
    """What an index takes of a table of units."""
    table = pq.read_table(io.BytesIO(data), columns=[*INDEXED, "geometry"])
    shapes = shapely.from_wkb(table.column("geometry").to_numpy(zero_copy_only=False))
    return UnitTable(table.select(INDEXED).replace_schema_metadata(None), np.asarray(shapes, object).tolist())


def indexed(rows: Sequence[tuple[str, str, str, str]], shapes: Sequence[BaseGeometry | None]) -> UnitTable:
    """Rows of id, tile, status and verdict as a table."""
    columns = {name: pa.array([row[k] for row in rows], pa.string()) for k, name in enumerate(INDEXED)}
    return UnitTable(pa.table(columns), shapes)


def _written(table: pa.Table, shapes: Sequence[BaseGeometry | None], reference: Reference) -> bytes:
    crs = horizontal_crs(reference)
    return geoparquet_bytes(table, shapes, None if crs is None else crs.to_wkt())


def _text(value: Scalar) -> str | None:
    return None if value is None else str(value)
