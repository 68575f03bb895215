"""Attributes in glTF: property tables after EXT_structural_metadata, a typed column per attribute.

A column's type is the narrowest that holds all of its values: truth values, 32-bit integers, doubles, text. Where a
value is missing, numbers have a `noData` that no value equals, text is empty; truth values with gaps become text.
Columns without any value are left out.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Scalar
from cityflow.io.city_models.gltf_buffer import GltfBuffer

Json = Any
EXTENSION = "EXT_structural_metadata"
_NOT_IN_IDS = re.compile(r"[^A-Za-z0-9_]")
_MISSING_INTEGERS = (-2147483648, -2147483647, -2147483646)
_MISSING_NUMBERS = (-9999.0, -999999.0, -1e30)
_LARGEST_EXACT = 2**53


@dataclass(frozen=True, slots=True)
class Column:
    """An attribute of all features: its name as the source wrote it, a value for each; `meaning` for people to read."""

    name: str
    values: Sequence[Scalar]
    meaning: str = ""


@dataclass(frozen=True, slots=True)
class Classes:
    """A column of few known words, stored as an enumeration: (N,) indices among `words`."""

    name: str
    values: NDArray[np.uint8]
    words: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """Features of one kind: the class's id, how many, and their columns."""

    kind: str
    count: int
    columns: tuple[Column | Classes, ...]


def columns_of(rows: Sequence[Mapping[str, Scalar]]) -> tuple[Column, ...]:
    """A column per key of any row, in the order of first appearance; what a row lacks is None."""
    names = dict.fromkeys(name for row in rows for name in row)
    return tuple(Column(name, [row.get(name) for row in rows]) for name in names)


def structural_metadata(tables: Sequence[Table], buffer: GltfBuffer) -> dict[str, Json]:
    """The extension's object of a document; values go to the buffer."""
    classes: dict[str, Json] = {}
    enums: dict[str, Json] = {}
    written = []
    for table in tables:
        properties: dict[str, Json] = {}
        values: dict[str, Json] = {}
        for column in table.columns:
            key = _key(column.name, properties)
            found = _enumeration(column, enums, buffer) if isinstance(column, Classes) else _column(column, buffer)
            if found is not None:
                properties[key], values[key] = {"name": column.name, **found[0]}, found[1]
        classes[table.kind] = {"properties": properties}
        written.append({"name": table.kind, "class": table.kind, "count": table.count, "properties": values})
    schema = {"id": "cityflow", "classes": classes, **({"enums": enums} if enums else {})}
    return {"schema": schema, "propertyTables": written}


def _key(name: str, taken: Mapping[str, Json]) -> str:
    """An id that the extension allows, unlike all others; attributes that differ in other letters alone get a number."""
    plain = _NOT_IN_IDS.sub("_", name) or "_"
    plain = f"_{plain}" if plain[0].isdigit() else plain
    key, number = plain, 2
    while key in taken:
        key, number = f"{plain}_{number}", number + 1
    return key


def _enumeration(column: Classes, enums: dict[str, Json], buffer: GltfBuffer) -> tuple[Json, Json]:
    words = [{"name": word, "value": value} for value, word in enumerate(column.words)]
    enums[column.name] = {"valueType": "UINT8", "values": words}
    return {"type": "ENUM", "enumType": column.name}, {"values": buffer.view(column.values.astype(np.uint8).tobytes())}


def _column(column: Column, buffer: GltfBuffer) -> tuple[Json, Json] | None:
    """The property of the class, and that of the table; None for a column without values."""
    known = [value for value in column.values if value is not None]
    if not known:
        return None
    meaning = {"description": column.meaning} if column.meaning else {}
    if all(isinstance(value, bool) for value in known) and len(known) == len(column.values):
        packed = np.packbits(np.array(column.values, bool), bitorder="little")
        return {"type": "BOOLEAN", **meaning}, {"values": buffer.view(packed.tobytes())}
    if not any(isinstance(value, (bool, str)) for value in known):
        found = _numbers(column.values, [float(value) for value in known], buffer)
        if found is not None:
            return {**found[0], **meaning}, found[1]
    return _texts(column.values, meaning, buffer)


def _numbers(values: Sequence[Scalar], known: Sequence[float], buffer: GltfBuffer) -> tuple[Json, Json] | None:
    are_integers = all(isinstance(value, int) for value in values if value is not None)
    if are_integers and max(map(abs, known)) > _LARGEST_EXACT:
        return None
    is_narrow = are_integers and max(map(abs, known)) < -_MISSING_INTEGERS[-1]
    stand_ins = _MISSING_INTEGERS if is_narrow else _MISSING_NUMBERS
    missing = next(s for s in stand_ins if s not in known)
    filled = np.array([missing if value is None else value for value in values], np.int32 if is_narrow else np.float64)
    schema: dict[str, Json] = {"type": "SCALAR", "componentType": "INT32" if is_narrow else "FLOAT64"}
    if len(known) < len(values):
        schema["noData"] = missing
    return schema, {"values": buffer.view(filled.tobytes())}


def _texts(values: Sequence[Scalar], meaning: Json, buffer: GltfBuffer) -> tuple[Json, Json] | None:
    encoded = [_text(value).encode("utf-8", "replace") for value in values]
    joined = b"".join(encoded)
    if not joined:
        return None
    offsets = np.cumsum([0, *map(len, encoded)]).astype(np.uint32)
    schema = {"type": "STRING", **({"noData": ""} if any(value is None for value in values) else {}), **meaning}
    return schema, {
        "values": buffer.view(joined), "stringOffsets": buffer.view(offsets.tobytes()), "stringOffsetType": "UINT32",
    }  # fmt: skip


def _text(value: Scalar) -> str:
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else str(value)
