"""Rows of attributes as typed columns: one type for each key, whatever rows and files it is spread over."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Scalar

Column = tuple[str, NDArray[Any], NDArray[np.bool_]]
"""Name, values, mask of nulls."""
Row = Mapping[str, Scalar]
TOO_LONG = "too long"
"""A whole number of more than 64 bits."""


@dataclass(frozen=True, slots=True)
class Keys:
    """Keys in the order in which rows first have them, each with the kinds of its values."""

    kinds: dict[str, set[str]] = field(default_factory=dict)

    def take(self, rows: Iterable[Row]) -> Self:
        """Take in the keys of more rows."""
        for row in rows:
            for key, value in row.items():
                found = self.kinds.setdefault(key, set())
                if value is not None:
                    found.add(_kind(value))
        return self


def columns_of(rows: Sequence[Row], reserved: Sequence[str], keys: Keys | None = None) -> list[Column]:
    """A column for each key.

    Parameters
    ----------
    reserved : names that no column may have
    keys : of all rows, where these are some of them
    """
    kinds = (Keys().take(rows) if keys is None else keys).kinds
    named = zip(_names(list(kinds), reserved), kinds.items(), strict=True)
    return [(name, *_typed([row.get(key) for row in rows], found)) for name, (key, found) in named]


def _kind(value: Scalar) -> str:
    return TOO_LONG if isinstance(value, int) and abs(value) >= 2**63 else type(value).__name__


def _typed(values: Sequence[Scalar], kinds: set[str]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """One type for all that is known: bool, integer, float, else text."""
    mask = np.array([value is None for value in values], bool)
    if kinds == {"bool"}:
        return np.array([bool(value) for value in values], bool), mask
    if kinds == {"int"}:
        return np.array([0 if value is None else value for value in values], np.int64), mask
    if kinds and kinds <= {"int", "float"}:
        return np.array([np.nan if value is None else value for value in values], np.float64), mask
    return np.array([None if value is None else _as_text(value) for value in values], object), mask


def _as_text(value: Scalar) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _names(keys: Sequence[str], reserved: Sequence[str]) -> list[str]:
    """Names that SQLite tells apart, too: it does not look at case."""
    taken = set(reserved)
    names = []
    for key in keys:
        name, number = key or "_", 2
        while name.lower() in taken:
            name, number = f"{key}_{number}", number + 1
        taken.add(name.lower())
        names.append(name)
    return names
