"""Rows of many segments in memory, about a hundred bytes each, found by the key of their unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Status
from cityflow.flow.record_segments import key_of
from cityflow.flow.records import quoted
from cityflow.flow.row import NAMES, Row
from cityflow.flow.some_units import SomeUnits

TOLD = 8192
"""Rows made into values at once."""


class Place(NamedTuple):
    """Where a record stands, and its order among those of its unit; `digest`: its first 64 bits."""

    attempt: int
    started: float
    frame: int
    start: int
    bytes: int
    digest: int


@dataclass(frozen=True)
class Rows:
    """A table as `segments.SCHEMA` has it, with frames numbered through all segments, and its order by key, attempt and start."""

    table: Any
    order: IntArray = field(init=False, repr=False)
    keys: np.ndarray = field(init=False, repr=False)
    _places: tuple[np.ndarray, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        key, attempt, started = (column(self.table, name) for name in ("key", "attempt", "started"))
        order = ordered(key, attempt, started).astype(np.int32)
        object.__setattr__(self, "order", order)
        object.__setattr__(self, "keys", key[order])
        object.__setattr__(self, "_places", tuple(column(self.table, name) for name in Place._fields))

    def __len__(self) -> int:
        return len(self.keys)

    def find(self, key: int, unit: str | None) -> Iterator[Place]:
        """Records of a unit; None: whatever its whole name is."""
        wanted = np.uint64(key)
        at = int(np.searchsorted(self.keys, wanted))
        while at < len(self.keys) and self.keys[at] == wanted:
            i = int(self.order[at])
            if unit is None or self.table["unit"][i].as_py() == unit:
                yield Place(*(values[i].item() for values in self._places))
            at += 1

    def knows(self, key: int) -> bool:
        """Whether there is a record of a unit: of this key, which is of 64 bits."""
        at = int(np.searchsorted(self.keys, np.uint64(key)))
        return at < len(self.keys) and bool(self.keys[at] == np.uint64(key))

    def newest(self, stage: str | None) -> IntArray:
        """Rows of the table (int64) that are the newest of their unit, of one stage or all."""
        last = np.ones(len(self.keys), bool)
        last[:-1] = self.keys[1:] != self.keys[:-1]
        found = self.order[last].astype(np.int64)
        if stage is None:
            return found
        mask = pc.equal(self.table["stage"], stage).to_numpy()
        return found[mask[found]]

    def overlaid(self, loose: Sequence[Row], newest: IntArray) -> tuple[list[Row], IntArray]:
        """Newest rows of elsewhere and of here (as `newest` gives them), each unit in one of them only: where its later record is."""
        key, attempt, started = (column(self.table, name)[newest] for name in ("key", "attempt", "started"))
        kept, rows = np.ones(len(newest), bool), []
        wanted = np.array([key_of(quoted(row.stage), quoted(row.unit)) for row in loose], np.uint64)
        for row, mine, i in zip(loose, wanted, np.searchsorted(key, wanted), strict=True):
            here = i < len(key) and key[i] == mine
            if here and (attempt[i], started[i]) > (row.attempt, row.started):
                continue
            rows.append(row)
            if here:
                kept[i] = False
        return rows, newest[kept]

    def among(self, rows: IntArray, units: SomeUnits) -> IntArray:
        """Those of some rows that are of these units."""
        if units.all_but and not units.names:
            return rows
        found = pc.is_in(self.table["unit"].take(pa.array(rows)), pa.array(units.names, pa.string())).to_numpy()
        return rows[found != units.all_but]

    def kinds(self, rows: IntArray) -> dict[tuple[Status, str], int]:
        """How many of some rows have which status and verdict."""
        part = self.table.select(["status", "verdict"]).take(pa.array(rows))
        plain = pa.table([column.cast(pa.string()) for column in part.columns], names=["status", "verdict"])
        counted = plain.group_by(["status", "verdict"], use_threads=False).aggregate([([], "count_all")]).to_pylist()
        return {(Status(found["status"]), found["verdict"]): found["count_all"] for found in counted}

    def not_done(self, rows: IntArray) -> IntArray:
        found = pc.not_equal(self.table["status"].take(pa.array(rows)), str(Status.DONE))
        return rows[found.to_numpy()]

    def figures(self, name: str, rows: IntArray) -> FloatArray:
        """A column of those of some rows that gave a result."""
        good = pc.is_in(self.table["status"].take(pa.array(rows)), pa.array([str(status) for status in GOOD]))
        found: FloatArray = column(self.table, name)[rows[good.to_numpy()]]
        return found

    def attempts(self) -> int:
        """How many there are, those of the same number counted once."""
        attempt = column(self.table, "attempt")[self.order]
        same = (self.keys[1:] == self.keys[:-1]) & (attempt[1:] == attempt[:-1])
        return len(self.keys) - int(same.sum())

    def without(self, dead: BoolArray) -> Rows:
        """Less the rows that a mask names."""
        return Rows(self.table.filter(pa.array(~dead)))

    def names(self, rows: IntArray) -> list[str]:
        """Units of some rows."""
        names: list[str] = self.table["unit"].take(pa.array(rows)).to_pylist()
        return names

    def told(self, rows: IntArray) -> Iterator[Row]:
        """Rows of the table, as values."""
        table = self.table.select(NAMES)
        for begin in range(0, len(rows), TOLD):
            part = table.take(pa.array(rows[begin : begin + TOLD]))
            columns = [c.to_pylist() for c in part.columns]
            columns[NAMES.index("status")] = [STATUS[s] for s in columns[NAMES.index("status")]]
            yield from map(Row, *columns)


def ordered(key: np.ndarray, attempt: np.ndarray, started: np.ndarray) -> IntArray:
    """Rows by key, attempt and start, as `np.lexsort` has them, in a third of its time: nearly all keys stand once.

    >>> ordered(np.array([7, 2, 7, 7]), np.array([2, 1, 1, 1]), np.array([0.0, 0.0, 2.0, 1.0])).tolist()
    [1, 3, 2, 0]
    """
    order = np.argsort(key)
    sorted_key, same = key[order], np.zeros(len(key) + 1, bool)
    same[1:-1] = sorted_key[1:] == sorted_key[:-1]
    several = np.flatnonzero(same[1:] | same[:-1])
    rows = np.sort(order[several])
    order[several] = rows[np.lexsort((started[rows], attempt[rows], key[rows]))]
    return order


GOOD = (Status.DONE, Status.DEGRADED)
"""A unit gave a result."""

STATUS = {str(status): status for status in Status}


def column(table: Any, name: str) -> np.ndarray:
    """A column of numbers, without a copy where it is in one piece."""
    chunked = table[name]
    values: np.ndarray = (chunked.chunk(0) if chunked.num_chunks == 1 else chunked).to_numpy()
    return values


def merged(parts: Sequence[Any]) -> Rows:
    """One out of several tables."""
    return Rows(pa.concat_tables(parts).unify_dictionaries().combine_chunks())
