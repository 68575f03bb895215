"""The ledger: a SQLite index over the records of a RUN, rebuilt or completed from them on opening."""

from __future__ import annotations

import sqlite3
import zlib
from collections.abc import Iterable, Iterator
from enum import StrEnum
from itertools import islice
from types import TracebackType
from typing import Any

from cityflow.core.building import Status
from cityflow.flow import index
from cityflow.flow.outputs import Outputs
from cityflow.flow.records import FOLDER, STARTED, decode, encode, quoted
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task

COMMIT_EVERY = 200
"""Records added between two commits; a killed driver loses nothing, since the records are files."""

BATCH = 2000


class State(StrEnum):
    """What the ledger knows of a task (ARCHITECTURE.md, section 3)."""

    DONE = "done"
    """The newest attempt has a record with the task's digest (whatever its status), and its outputs are there."""
    STALE = "stale"
    """The newest record is of other inputs, parameters or another version."""
    MISSING = "missing"
    """There is no record."""
    SPOILED = "spoiled"
    """An attempt that writes in place started after the newest record and left none."""
    LOST = "lost"
    """The record is right, but an output is gone."""


class Ledger:
    """Index over the records of one RUN; made by `Ledger.open`. Belongs to the thread that opened it."""

    def __init__(self, store: Store, database: sqlite3.Connection) -> None:
        self.store = store
        self._db = database
        self._outputs = Outputs(store)
        self._uncommitted = 0

    @classmethod
    def open(cls, store: Store) -> Ledger:
        """Open the index and bring it up to date with the records; makes a new one where it is missing or corrupt."""
        ledger = cls(store, index.connect(store))
        try:
            ledger.refresh()
        except sqlite3.DatabaseError as error:
            if not index.is_corrupt(error):
                raise
            ledger._db.close()
            ledger = cls(store, index.connect(store, anew=True))
            ledger.refresh()
        return ledger

    def __enter__(self) -> Ledger:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        self._db.commit()
        self._db.close()

    def refresh(self) -> int:
        """Take over records and marks that others wrote, forget those that are gone; returns how many were new."""
        new = 0
        for stage in self.store.folders(FOLDER):
            found = {(folder, name) for _, folder, name in map(_split, self.store.find(f"{FOLDER}/{stage}"))}
            known = set(self._db.execute("SELECT folder, name FROM files WHERE stage = ?", (stage,)))
            self._forget(stage, known - found)
            new += self._take(stage, sorted(found - known))
        gone = {row[0] for row in self._db.execute("SELECT DISTINCT stage FROM files")} - set(
            self.store.folders(FOLDER)
        )
        for stage in gone:
            self._db.execute("DELETE FROM files WHERE stage = ?", (stage,))
        self._db.commit()
        return new

    def add(self, record: Record) -> None:
        """Index a record that a task has just written."""
        self._insert([record])
        self._outputs.add(record)
        self._uncommitted += 1
        if self._uncommitted >= COMMIT_EVERY:
            self.commit()

    def commit(self) -> None:
        self._uncommitted = 0
        self._db.commit()

    def latest(self, stage: str, unit: str) -> Record | None:
        """The record with the highest attempt, or None."""
        key = (quoted(stage), quoted(unit))
        row = self._db.execute(f"SELECT body {_NEWEST} ", key).fetchone()
        return _unpacked(row[0]) if row else None

    def attempts(self, stage: str, unit: str) -> list[Record]:
        """All records of a unit, oldest first."""
        query = "SELECT body FROM files WHERE stage = ? AND folder = ? AND body IS NOT NULL ORDER BY attempt"
        return [_unpacked(body) for (body,) in self._db.execute(query, (quoted(stage), quoted(unit)))]

    def records(self, stage: str | None = None) -> Iterator[Record]:
        """The newest record of every unit, of one stage or of all, sorted by stage and unit."""
        where, values = ("", ()) if stage is None else ("WHERE stage = ?", (quoted(stage),))
        cursor = self._db.execute(f"SELECT body FROM newest {where} ORDER BY stage, folder", values)
        return (_unpacked(body) for (body,) in cursor)

    def units(self, stage: str, status: Status | None = None) -> list[str]:
        """Names of the units that have a record, sorted; those whose newest record has `status` where given."""
        where, values = ("", ()) if status is None else ("AND status = ?", (str(status),))
        query = f"SELECT unit FROM newest WHERE stage = ? {where} ORDER BY unit"
        return [unit for (unit,) in self._db.execute(query, (quoted(stage), *values))]

    def stages(self) -> list[str]:
        """Names of the stages that have records, sorted."""
        rows = self._db.execute("SELECT DISTINCT stage_name FROM files WHERE body IS NOT NULL ORDER BY 1")
        return [name for (name,) in rows]

    def count_by_status(self, stage: str) -> dict[Status, int]:
        """How many units have a newest record of each status; every status is a key."""
        rows = dict(
            self._db.execute("SELECT status, COUNT(*) FROM newest WHERE stage = ? GROUP BY status", (quoted(stage),))
        )
        return {status: rows.get(str(status), 0) for status in Status}

    def next_attempt(self, stage: str, unit: str) -> int:
        """One more than the highest attempt that has a record or a mark."""
        query = "SELECT MAX(attempt) FROM files WHERE stage = ? AND folder = ?"
        return (self._db.execute(query, (quoted(stage), quoted(unit))).fetchone()[0] or 0) + 1

    def mean_seconds(self, stage: str) -> float | None:
        """Mean time of the units of a stage that gave a result, or None where there is none."""
        return self._mean(stage, "AVG(seconds)")

    def peak_mb(self, stage: str) -> float | None:
        """Highest memory of the units of a stage that gave a result, or None where there is none."""
        return self._mean(stage, "MAX(peak_mb)")

    def state(self, task: Task) -> State:
        """What has to be done about a task; see `State`."""
        key = (quoted(task.stage), quoted(task.unit))
        row = self._db.execute(f"SELECT digest, attempt, body {_NEWEST}", key).fetchone()
        mark = self._db.execute(
            "SELECT MAX(attempt) FROM files WHERE stage = ? AND folder = ? AND body IS NULL", key
        ).fetchone()[0]
        if mark is not None and (row is None or mark > row[1]):
            return State.SPOILED
        if row is None:
            return State.MISSING
        if row[0] != task.digest:
            return State.STALE
        return State.DONE if self._outputs.all_there(_unpacked(row[2])) else State.LOST

    def _mean(self, stage: str, what: str) -> float | None:
        query = f"SELECT {what} FROM newest WHERE stage = ? AND status IN ('done', 'degraded')"
        value = self._db.execute(query, (quoted(stage),)).fetchone()[0]
        return None if value is None else float(value)

    def _forget(self, stage: str, gone: Iterable[tuple[str, str]]) -> None:
        query = "DELETE FROM files WHERE stage = ? AND folder = ? AND name = ?"
        self._db.executemany(query, [(stage, folder, name) for folder, name in gone])

    def _take(self, stage: str, names: list[tuple[str, str]]) -> int:
        marks = [(folder, name) for folder, name in names if name.endswith(STARTED)]
        self._db.executemany(
            "INSERT OR REPLACE INTO files (stage, folder, name, attempt) VALUES (?, ?, ?, ?)",
            [(stage, folder, name, attempt) for folder, name in marks if (attempt := _attempt(name)) is not None],
        )
        paths = [f"{FOLDER}/{stage}/{folder}/{name}" for folder, name in names if name.endswith(".json")]
        read = self.store.read_many(paths)
        taken = 0
        while batch := list(islice(read, BATCH)):
            taken += self._insert([r for r in (_readable(data) for _, data in batch) if r is not None])
        return taken

    def _insert(self, records: list[Record]) -> int:
        self._db.executemany(_INSERT, [_row(record) for record in records])
        return len(records)


_NEWEST = "FROM files WHERE stage = ? AND folder = ? AND body IS NOT NULL ORDER BY attempt DESC LIMIT 1"

_INSERT = """INSERT OR REPLACE INTO files
(stage, folder, name, attempt, stage_name, unit, digest, status, seconds, peak_mb, body)
VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"""


def _row(record: Record) -> tuple[Any, ...]:
    stage, folder, name = quoted(record.stage), quoted(record.unit), f"{record.attempt:04d}.json"
    indexed = (record.stage, record.unit, record.digest, str(record.status), record.seconds, record.peak_mb)
    return (stage, folder, name, record.attempt, *indexed, zlib.compress(encode(record), 1))


def _unpacked(body: bytes) -> Record:
    return decode(zlib.decompress(body))


def _readable(data: bytes) -> Record | None:
    """A record cut short by a crash of the machine counts as not written."""
    try:
        return decode(data)
    except (ValueError, TypeError):
        return None


def _split(path: str) -> tuple[str, str, str]:
    _, stage, folder, name = path.split("/", 3)
    return stage, folder, name


def _attempt(name: str) -> int | None:
    digits = name.split(".", 1)[0]
    return int(digits) if digits.isdigit() else None
