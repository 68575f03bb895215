"""Layers of a GeoPackage of edits, as tables of SQLite: their geometries, reference systems and columns."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from cityflow.io.tables.edits_gpkg import CUT_LINES, ID_COLUMN, LOCKED, NO_CUT_LINES, OUTLINES, ROOF_TYPES, TYPE_COLUMN

EDIT, WHO, WHEN, FORMER = "edit", "edited_by", "edited_at", "former"
"""Columns: name of the edit, who made it and when, and what it replaced."""
LINES, POLYGONS = (CUT_LINES, NO_CUT_LINES), (OUTLINES, LOCKED)


@dataclass(frozen=True, slots=True)
class EditsTable:
    """A layer: name of its geometry's column, kind, number and CRS of its reference system, columns."""

    name: str
    geometry: str
    kind: str
    srs: int
    crs: CRS | None
    columns: frozenset[str]

    @classmethod
    def find(cls, base: sqlite3.Connection, name: str) -> EditsTable | None:
        row = base.execute(
            "SELECT g.column_name, g.geometry_type_name, g.srs_id, s.organization, s.organization_coordsys_id, s.definition "
            "FROM gpkg_geometry_columns g LEFT JOIN gpkg_spatial_ref_sys s ON g.srs_id = s.srs_id WHERE g.table_name = ?", [name],
        ).fetchone()  # fmt: skip
        if row is None:
            return None
        geometry, kind, srs, organisation, code, definition = row
        crs = None
        if srs > 0:
            crs = CRS.from_epsg(code) if str(organisation).upper() == "EPSG" else CRS.from_wkt(definition)
        columns = frozenset(str(r[1]) for r in base.execute(f'PRAGMA table_info("{name}")'))
        return cls(name, str(geometry), str(kind).upper(), int(srs), crs, columns)

    @classmethod
    def of(cls, base: sqlite3.Connection, name: str) -> EditsTable:
        """With the columns of edits, which are added where they are missing."""
        found = cls.find(base, name)
        assert found is not None
        own = {TYPE_COLUMN: "TEXT"} if name == ROOF_TYPES else {ID_COLUMN: "TEXT"} if name in POLYGONS else {}
        for column, kind in {**own, EDIT: "TEXT", WHO: "TEXT", WHEN: "REAL", FORMER: "TEXT"}.items():
            if column not in found.columns:
                base.execute(f'ALTER TABLE "{name}" ADD COLUMN {column} {kind}')
        return found


def make_layer(path: Path, layer: str, crs: str | None, append: bool) -> None:
    import pyogrio.raw

    kind = "LineString" if layer in LINES else "Polygon" if layer in POLYGONS else "Unknown"
    text = [*([TYPE_COLUMN] if layer == ROOF_TYPES else [ID_COLUMN] if layer in POLYGONS else []), EDIT, WHO, FORMER]
    none = [np.array([], object) for _ in text]
    pyogrio.raw.write(
        path, np.array([], object), [*none, np.array([], np.float64)], [*text, WHEN], layer=layer, driver="GPKG",
        geometry_type=kind, crs=crs, append=append,
    )  # fmt: skip


_ENVELOPES = {0: 0, 1: 32, 2: 48, 3: 48, 4: 64}
"""Bytes of the box in a GeoPackage geometry, by its kind."""


def shape_in(blob: bytes) -> BaseGeometry:
    """The geometry of a GeoPackage's binary."""
    return shapely.force_2d(shapely.from_wkb(blob[8 + _ENVELOPES[blob[3] >> 1 & 7] :]))


def blob_of(shape: BaseGeometry, srs: int) -> bytes:
    return b"GP\0\1" + struct.pack("<i", srs) + shapely.to_wkb(shape, byte_order=1)


def _edge(number: int) -> Callable[[bytes | None], float | None]:
    return lambda blob: None if blob is None else float(shape_in(blob).bounds[number])


FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "ST_IsEmpty": lambda blob: None if blob is None else int(shape_in(blob).is_empty),
    "ST_MinX": _edge(0), "ST_MinY": _edge(1), "ST_MaxX": _edge(2), "ST_MaxY": _edge(3),
}  # fmt: skip
"""What the triggers of a spatial index call."""
