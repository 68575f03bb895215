"""Writes single edits into the file of edits, beside QGIS and other writers: each is one transaction of SQLite (docs/desk.md)."""

from __future__ import annotations

import json
import os
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import horizontal_crs, horizontal_transform, transformed
from cityflow.io.tables.edits_gpkg import ID_COLUMN, LAYERS, ONE_LIBRARY, ROOF_TYPES, TYPE_COLUMN, checked, known_type
from cityflow.io.tables.edits_tables import (
    EDIT,
    FORMER,
    FUNCTIONS,
    POLYGONS,
    WHEN,
    WHO,
    EditsTable,
    blob_of,
    make_layer,
    shape_in,
)

PATIENCE_S = 10.0
"""How long another writer is waited for."""


@dataclass(frozen=True, slots=True)
class Edit:
    """One feature of the file.

    Attributes
    ----------
    name : tells it from all others; empty for one that was drawn elsewhere, for example in QGIS
    layer : one of `LAYERS`
    shape : world metres
    value : id of an outline, or roof type; else empty
    who, when : seconds since 1970; empty and 0 where the file does not say
    """

    name: str
    layer: str
    shape: BaseGeometry
    value: str = ""
    who: str = ""
    when: float = 0.0

    def as_text(self) -> str:
        return json.dumps(
            [self.name, self.layer, shapely.to_wkb(self.shape, hex=True), self.value, self.who, self.when]
        )

    @classmethod
    def of_text(cls, text: str) -> Edit:
        name, layer, wkb, *more = json.loads(text)
        return cls(name, layer, shapely.from_wkb(wkb), *more)


class ConflictError(CatalogError):
    """Somebody else has changed what an edit is about."""


@dataclass(frozen=True, slots=True)
class EditsFile:
    """A GeoPackage of edits in a local folder; it is made with the first edit. `reference`: of the world."""

    path: Path
    reference: Reference

    def add(self, edit: Edit, replaces: str = "") -> Edit:
        """Write an edit, in place of another one where that is named; returns it as it was written.

        Raises
        ------
        CatalogError
            Its shape or value is none that the layer takes, or the file cannot be written.
        ConflictError
            The edit that it replaces is gone, or an outline of its id is drawn already.
        """
        shape = checked(edit.layer, edit.shape, lambda problem, remedy: self._wrong(f"the drawing {problem}", remedy))
        if edit.layer == ROOF_TYPES:
            known_type(str(self.path), edit.value)
        new = Edit(edit.name, edit.layer, shape, edit.value, edit.who, edit.when)
        with self._writing(edit.layer) as (base, table):
            former = self._taken(base, replaces) if replaces else None
            if new.layer in POLYGONS and new.value and _has_id(base, new.value):
                raise ConflictError(
                    f"an outline {new.value!r} is drawn already", where=str(self.path), remedy="undo that edit, or change it there"
                )  # fmt: skip
            self._insert(base, table, new, former)
        return new

    def remove(self, name: str) -> Edit:
        """Take an edit back; what it had replaced stands again. Raises ConflictError where there is no such edit any more."""
        if not name or not self.path.is_file():
            raise self._gone()
        with self._open() as base:
            former = self._former(base, name)
            removed = self._taken(base, name)
            if former is not None:
                self._insert(base, EditsTable.of(base, former.layer), former, None)
        return removed

    def edits(self) -> list[Edit]:
        """All features, those drawn elsewhere too; in the order of the layers and of the file."""
        if not self.path.is_file():
            return []
        with ONE_LIBRARY, closing(self._connected()) as base:
            return [
                edit
                for name in LAYERS
                if (table := EditsTable.find(base, name)) is not None
                for edit in self._read(base, table)
            ]

    def _read(self, base: sqlite3.Connection, table: EditsTable) -> Iterator[Edit]:
        value = TYPE_COLUMN if table.name == ROOF_TYPES else ID_COLUMN
        wanted = [c if c in table.columns else "NULL" for c in (EDIT, value, WHO, WHEN)]
        for blob, *row in base.execute(f'SELECT "{table.geometry}", {", ".join(wanted)} FROM "{table.name}"'):
            if blob is not None:
                name, given, who, when = row
                yield Edit(
                    str(name or ""),
                    table.name,
                    self._world(table, shape_in(blob)),
                    str(given or ""),
                    str(who or ""),
                    float(when or 0.0),
                )

    def _former(self, base: sqlite3.Connection, name: str) -> Edit | None:
        for table in _tables(base):
            if EDIT in table.columns:
                found = base.execute(f'SELECT {FORMER} FROM "{table.name}" WHERE {EDIT} = ?', [name]).fetchone()
                if found and found[0]:
                    return Edit.of_text(found[0])
        return None

    def _taken(self, base: sqlite3.Connection, name: str) -> Edit:
        """An edit that is in the file no more."""
        for table in _tables(base):
            found = next((e for e in self._read(base, table) if e.name == name), None)
            if found is not None:
                base.execute(f'DELETE FROM "{table.name}" WHERE {EDIT} = ?', [name])
                return found
        raise self._gone()

    def _insert(self, base: sqlite3.Connection, table: EditsTable, edit: Edit, former: Edit | None) -> None:
        shape = edit.shape
        if table.kind == "POINT" and shape.geom_type == "Polygon":
            shape = shape.representative_point()
        row: dict[str, Any] = {
            table.geometry: blob_of(self._own(table, shape), table.srs), EDIT: edit.name, WHO: edit.who, WHEN: edit.when,
            FORMER: None if former is None else former.as_text(),
        }  # fmt: skip
        if edit.layer in (*POLYGONS, ROOF_TYPES):
            row[TYPE_COLUMN if edit.layer == ROOF_TYPES else ID_COLUMN] = edit.value or None
        names = ", ".join(f'"{c}"' for c in row)
        base.execute(f'INSERT INTO "{table.name}" ({names}) VALUES ({", ".join("?" * len(row))})', list(row.values()))
        base.execute(
            "UPDATE gpkg_contents SET last_change = strftime('%Y-%m-%dT%H:%M:%fZ', 'now') WHERE table_name = ?", [table.name]
        )  # fmt: skip

    @contextmanager
    def _writing(self, layer: str) -> Iterator[tuple[sqlite3.Connection, EditsTable]]:
        if not self.path.is_file():
            self._make()
        with self._open() as base:
            if EditsTable.find(base, layer) is None:
                raise self._wrong(f"the file has no layer {layer}", f"add an empty layer {layer} in QGIS")
            yield base, EditsTable.of(base, layer)

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        """One transaction: it is written as a whole, or not at all."""
        try:
            with ONE_LIBRARY, closing(self._connected()) as base:
                base.execute("BEGIN IMMEDIATE")
                try:
                    yield base
                except BaseException:
                    base.execute("ROLLBACK")
                    raise
                base.execute("COMMIT")
        except sqlite3.Error as error:
            raise self._wrong(
                f"the file cannot be written ({error})", "end the editing of its layers in QGIS, and try again"
            ) from error

    def _connected(self) -> sqlite3.Connection:
        base = sqlite3.connect(self.path, timeout=PATIENCE_S, isolation_level=None)
        for name, function in FUNCTIONS.items():
            base.create_function(name, 1, function, deterministic=True)
        return base

    def _make(self) -> None:
        """The file with all layers, without features: written beside its place, and put there unless another one was faster."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".edits-", dir=self.path.parent) as folder:
            made = Path(folder) / "edits.gpkg"
            crs = horizontal_crs(self.reference)
            for number, layer in enumerate(LAYERS):
                make_layer(made, layer, None if crs is None else crs.to_wkt(), append=number > 0)
            try:
                os.link(made, self.path)
            except FileExistsError:
                return

    def _own(self, table: EditsTable, shape: BaseGeometry) -> BaseGeometry:
        return self._between(self.reference, table.crs, shape) if self._differs(table) else shape

    def _world(self, table: EditsTable, shape: BaseGeometry) -> BaseGeometry:
        return self._between(table.crs, self.reference, shape) if self._differs(table) else shape

    def _differs(self, table: EditsTable) -> bool:
        here = horizontal_crs(self.reference)
        return table.crs is not None and here is not None and not table.crs.equals(here, ignore_axis_order=True)

    @staticmethod
    def _between(source: CRS | Reference | None, target: CRS | Reference | None, shape: BaseGeometry) -> BaseGeometry:
        assert source is not None
        assert target is not None
        way = horizontal_transform(source, target)
        return shapely.transform(shape, lambda xy: transformed(way, np.asarray(xy)))

    def _wrong(self, problem: str, remedy: str) -> CatalogError:
        return CatalogError(problem, where=str(self.path), remedy=remedy)

    def _gone(self) -> ConflictError:
        return ConflictError(
            "this edit is gone",
            where=str(self.path),
            remedy="somebody has undone it, or changed it since: look at the list of edits",
        )


def _tables(base: sqlite3.Connection) -> list[EditsTable]:
    return [table for name in LAYERS if (table := EditsTable.find(base, name)) is not None]


def _has_id(base: sqlite3.Connection, value: str) -> bool:
    tables = [t for t in _tables(base) if t.name in POLYGONS and ID_COLUMN in t.columns]
    return any(base.execute(f'SELECT 1 FROM "{t.name}" WHERE {ID_COLUMN} = ?', [value]).fetchone() for t in tables)
