"""Ids of features, from a column or by a user's format."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING

from cityflow.core.building import Scalar
from cityflow.errors import CatalogError

if TYPE_CHECKING:
    from cityflow.io.tables.vector import Layer

LISTED = 10
"""Ids that a note names before it says 'and more'."""


def ids_of(source: Layer, column: str | None, form: str | None) -> list[str]:
    if column is None:
        return [""] * len(source.geometry)
    if column not in source.columns:
        near = difflib.get_close_matches(column, source.columns, n=1)
        remedy = f"did you mean {near[0]!r}?" if near else f"choose one of: {', '.join(source.columns)}"
        raise CatalogError(f"no column {column!r} for the ids", where=source.path, remedy=remedy)
    try:
        return [format_id(value, form) for value in source.columns[column]]
    except (ValueError, IndexError, KeyError) as error:
        problem = f"the id format {form!r} does not suit column {column!r} ({error})"
        raise CatalogError(
            problem, where=source.path, remedy="use a Python format such as '{:016d}' for numbers or '{}' for text"
        ) from error


def format_id(value: Scalar, form: str | None) -> str:
    """An id as text; empty for a missing value.

    >>> format_id(503100000018603, "{:016d}"), format_id("17", "{:04d}"), format_id(None, "{}")
    ('0503100000018603', '0017', '')
    """
    if value is None or value == "":
        return ""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    try:
        return (form or "{}").format(value).strip()
    except ValueError:
        return (form or "{}").format(int(str(value))).strip()


def notes_on_ids(ids: list[str]) -> list[str]:
    notes = []
    missing = ids.count("")
    if missing:
        notes.append(f"outlines without an id: {missing}; theirs comes from their geometry")
    twice = sorted(unit for unit, n in Counter(ids).items() if n > 1 and unit)
    if twice:
        notes.append(f"ids that occur more than once: {len(twice)} ({listing(twice)})")
    return notes


def listing(names: Iterable[str]) -> str:
    """The first names, and whether there are more."""
    every = list(names)
    return ", ".join(every[:LISTED]) + (f" and {len(every) - LISTED} more" if len(every) > LISTED else "")
