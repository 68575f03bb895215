"""Rows of many segments in memory, about a hundred bytes each, found by the key of their unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.unit_status import Status
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
        """Rows of the table (int64) that are the newest of their unit, of one stage or all, in its order."""
        if stage is None:
            return self._newest()
        return self._newest_by_stage.get(stage, np.empty(0, np.int32)).astype(np.int64)

    def _newest(self) -> IntArray:
        is_newest = np.ones(len(self.keys), bool)
        is_newest[self.order[:-1][self.keys[1:] == self.keys[:-1]]] = False
        return np.flatnonzero(is_newest)

    @cached_property
    def _newest_by_stage(self) -> dict[str, IntArray]:
        """Parted once, and not by key: a command asks for every stage, and to look through millions of rows here and there takes longer the more there are."""
        found, (code, stages) = self._newest(), self._stage
        code = code[found].astype(np.uint16)
        grouped = found[np.argsort(code, kind="stable")].astype(np.int32)
        ends = np.cumsum(np.bincount(code, minlength=len(stages)))
        return dict(zip(stages, np.split(grouped, ends[:-1]), strict=True)) if stages else {}

    @cached_property
    def _stage(self) -> Words:
        return words(self.table, "stage")

    @cached_property
    def _status(self) -> Words:
        return words(self.table, "status")

    @cached_property
    def _verdict(self) -> Words:
        return words(self.table, "verdict")

    def overlaid(self, loose: Sequence[Row], newest: IntArray) -> tuple[list[Row], IntArray]:
        """Newest rows of elsewhere and of here (as `newest` gives them), each unit in one of them only: where its later record is."""
        if not loose or not len(self.keys):
            return [*loose], newest
        attempt, started = (column(self.table, name) for name in ("attempt", "started"))
        wanted = np.array([key_of(quoted(row.stage), quoted(row.unit)) for row in loose], np.uint64)
        gone, rows = np.zeros(len(self.keys), bool), []
        for row, key, at in zip(loose, wanted, np.searchsorted(self.keys, wanted, side="right") - 1, strict=True):
            i = self.order[at]  # the newest of its key
            here = at >= 0 and self.keys[at] == key
            if here and (attempt[i], started[i]) > (row.attempt, row.started):
                continue
            rows.append(row)
            if here:
                gone[i] = True
        return rows, newest[~gone[newest]]

    def by_place(self, rows: IntArray) -> IntArray:
        """Some rows in the order in which their records lie in segments."""
        frame, start = (column(self.table, name)[rows] for name in ("frame", "start"))
        return rows[np.lexsort((start, frame))]

    def among(self, rows: IntArray, units: SomeUnits) -> IntArray:
        """Those of some rows that are of these units."""
        if not len(rows) or (units.all_but and not units.names):
            return rows
        found = pc.is_in(self.table["unit"].take(pa.array(rows)), pa.array(units.names, pa.string())).to_numpy()
        return rows[found != units.all_but]

    def kinds(self, rows: IntArray) -> dict[tuple[Status, str], int]:
        """How many of some rows have which status and verdict, in the order in which these are met."""
        (status, statuses), (verdict, verdicts) = self._status, self._verdict
        kind = status[rows] * len(verdicts) + verdict[rows]
        count = np.bincount(kind)
        met = sorted(np.flatnonzero(count).tolist(), key=lambda k: int(np.argmax(kind == k)))
        return {(Status(statuses[k // len(verdicts)]), verdicts[k % len(verdicts)]): int(count[k]) for k in met}

    def not_done(self, rows: IntArray) -> IntArray:
        status, statuses = self._status
        return rows[~np.isin(statuses, str(Status.DONE))[status[rows]]] if len(rows) else rows

    def figures(self, name: str, rows: IntArray) -> FloatArray:
        """A column of those of some rows that gave a result."""
        status, statuses = self._status
        good = rows[np.isin(statuses, GOOD)[status[rows]]] if len(rows) else rows
        found: FloatArray = column(self.table, name)[good]
        return found

    def attempts(self) -> int:
        """How many there are, those of the same number counted once."""
        attempt, again = column(self.table, "attempt"), np.flatnonzero(self.keys[1:] == self.keys[:-1])
        return len(self.keys) - int((attempt[self.order[again]] == attempt[self.order[again + 1]]).sum())

    def without(self, dead: BoolArray) -> Rows:
        """Less the rows that a mask names."""
        return Rows(self.table.filter(pa.array(~dead)))

    def names(self, rows: IntArray) -> list[str]:
        """Units of some rows."""
        names: list[str] = self.table["unit"].take(pa.array(rows)).to_pylist() if len(rows) else []
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
    pieces = [numbers(piece) for piece in table[name].chunks]
    return pieces[0] if len(pieces) == 1 else np.concatenate([np.empty(0, table[name].type.to_pandas_dtype()), *pieces])


def numbers(values: Any) -> np.ndarray:
    """An array of Arrow's with numbers as one of numpy's, without a copy: Arrow's own way imports pandas, which takes longer than `status` of most runs."""
    if values.null_count:
        raise ValueError("a number is missing")
    kind, buffer = np.dtype(values.type.to_pandas_dtype()), values.buffers()[1]
    return np.frombuffer(buffer, kind, len(values), values.offset * kind.itemsize) if len(values) else np.empty(0, kind)


class Words(NamedTuple):
    """A column of few different texts: (N,) numbers of its rows, and the text of each number."""

    code: IntArray
    texts: list[str]


def words(table: Any, name: str) -> Words:
    """One that says the same thing many times."""
    if not len(table):
        return Words(np.empty(0, np.int32), [])
    found = table[name].combine_chunks()
    found = found if pa.types.is_dictionary(found.type) else found.dictionary_encode()
    found = found.combine_chunks() if isinstance(found, pa.ChunkedArray) else found
    return Words(numbers(found.indices), found.dictionary.to_pylist())


def merged(parts: Sequence[Any]) -> Rows:
    """One out of several tables."""
    return Rows(pa.concat_tables(parts).unify_dictionaries().combine_chunks())
