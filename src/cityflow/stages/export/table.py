"""Tables of units in a large city: one for each tile, and indexes over them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Outline, Scalar, Status
from cityflow.flow.store import Store
from cityflow.io.crs import resolve
from cityflow.io.tables.outlines_gpkg import unit_layer
from cityflow.io.tables.unit_tables import INDEX, UNITS, UnitTable, indexed, read_for_index, write_index, write_units
from cityflow.stages.export.items import PRODUCTS
from cityflow.stages.export.joined_products import unit_of

NO_TILE = ""
"""Stands for the tile of a refused outline: it belongs to none."""


def table_path(tile: str) -> str:
    """Of the units of a tile, in RUN."""
    return f"{PRODUCTS}{UNITS}/{tile}.parquet"


def index_path(unit: str) -> str:
    """Of an index over several tables, in RUN."""
    return f"{PRODUCTS}{INDEX}/{unit}.parquet"


def table_of(tile: str, outlines: Iterable[Outline], rows: Mapping[str, Mapping[str, Any]], crs: str) -> bytes:
    """Units of a tile with outline, fate and all attributes; `rows` of `handover.export_rows` by unit."""
    ordered = [o for o in sorted(outlines, key=lambda o: o.id) if o.id in rows]
    return write_units([_row(tile, o, rows[o.id]) for o in ordered], [o.polygon for o in ordered], resolve(crs))


def index_of(store: Store, tables: Iterable[str], crs: str) -> bytes:
    """The index over tables of tiles, by their paths in RUN."""
    return write_index((read_for_index(data) for _, data in store.read_many(sorted(tables))), resolve(crs))


def refused_index(reasons: Mapping[str, str], shapes: Mapping[str, BaseGeometry], crs: str) -> bytes:
    """An index of outlines that cannot be buildings; None where they are no polygon."""
    units = sorted(reasons)
    rows = [(unit, NO_TILE, str(Status.REFUSED), "") for unit in units]
    found: list[UnitTable] = [indexed(rows, [shapes.get(unit) for unit in units])]
    return write_index(found, resolve(crs))


def _row(tile: str, outline: Outline, row: Mapping[str, Any]) -> dict[str, Scalar]:
    attributes = row["attributes"]
    shown = {} if attributes is None else unit_layer([unit_of(outline, row)]).rows[0]
    own = {"id": outline.id, "tile": tile, "status": row["status"], "reason": row["reason"]}
    verdict = (attributes or {}).get("verdict")
    others = {f"source_{k}" if k in own else k: v for k, v in shown.items() if k not in ("id", "verdict")}
    return {**own, "verdict": verdict, **others}
