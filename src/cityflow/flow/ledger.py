"""The ledger: a SQLite index over the records of a RUN, rebuilt or completed from them on opening."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from enum import StrEnum
from itertools import islice
from types import TracebackType
from typing import Any, TypeVar

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow import index
from cityflow.flow.index import COLUMNS, DamagedIndexError
from cityflow.flow.ledger_rows import INSERT, NEWEST, attempt_of, readable_record, row_of, unpacked
from cityflow.flow.outputs import Outputs
from cityflow.flow.records import FOLDER, STARTED, encode, mark_path, quoted, record_path, write_mark
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task

COMMIT_EVERY = 200
"""Records added between two commits; a killed driver loses nothing, since the records are files."""

BATCH = 2000

PAGE = 500
"""Records fetched at once; what is read in one go is either sound or read again."""

PARTS = 4
"""Of the path of a record: ``records/<stage>/<unit>/<attempt>.json``."""

T = TypeVar("T")


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
    """The record is right, but an output is gone or is not what was written."""


class Ledger:
    """Index over the records of one RUN; made by `Ledger.open`. Belongs to the thread that opened it.

    The records are the truth: whatever is found to be wrong with the index, when it is opened or later, it is made anew.
    """

    def __init__(self, store: Store, *, verify: bool = False) -> None:
        self.store = store
        self._outputs = Outputs(store, verify=verify)
        self._uncommitted = 0
        self._db: sqlite3.Connection | None = None

    @classmethod
    def open(cls, store: Store, *, verify: bool = False) -> Ledger:
        """Open the index and bring it up to date with the records; makes a new one where it is missing or damaged.

        Parameters
        ----------
        verify : also hold the contents of outputs against their digests, not their sizes alone

        Raises
        ------
        RunError : there is no place for an index
        """
        ledger = cls(store, verify=verify)
        ledger._sound(ledger._checked)
        return ledger

    def __enter__(self) -> Ledger:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        if self._db is not None:
            with suppress(sqlite3.Error):  # the records are written; the next opening completes the index
                self._db.commit()
            self._db.close()

    def refresh(self) -> int:
        """Take over records and marks that others wrote, forget those that are gone or changed; returns how many were new."""
        return self._sound(self._refreshed)

    def add(self, record: Record) -> None:
        """Index a record that a task has just written."""
        self._sound(lambda: self._insert([(record, self._stamp(record))]))
        self._outputs.add(record)
        self._uncommitted += 1
        if self._uncommitted >= COMMIT_EVERY:
            self.commit()

    def commit(self) -> None:
        self._uncommitted = 0
        self._sound(self._database.commit)

    def spoil(self, stage: str, unit: str) -> None:
        """Say that what a task has left is not to be trusted: it is made again."""
        attempt = self.next_attempt(stage, unit)
        write_mark(self.store, stage, unit, attempt)
        name = mark_path(stage, unit, attempt).rsplit("/", 1)[1]
        self._sound(lambda: self._insert_marks(quoted(stage), [(quoted(unit), name, "")]))

    def latest(self, stage: str, unit: str) -> Record | None:
        """The record with the highest attempt, or None."""
        return self.latest_in(quoted(stage), quoted(unit))

    def latest_in(self, stage: str, folder: str) -> Record | None:
        """The same for names as they stand in paths."""
        return next(iter(self._records(NEWEST, (stage, folder))), None)

    def attempts(self, stage: str, unit: str) -> list[Record]:
        """All records of a unit, oldest first."""
        where = "FROM files WHERE stage = ? AND folder = ? AND body IS NOT NULL ORDER BY attempt"
        return self._records(where, (quoted(stage), quoted(unit)))

    def last_good(self, stage: str, unit: str) -> Record | None:
        """The newest record that left something, where the newest of all may have failed."""
        good = (r for r in reversed(self.attempts(stage, unit)) if r.status in (Status.DONE, Status.DEGRADED))
        return next(good, None)

    def records(self, stage: str | None = None) -> Iterator[Record]:
        """The newest record of every unit, of one stage or of all, sorted by stage and unit."""
        where, after = ("", ("", "")) if stage is None else ("AND stage = ?", (quoted(stage), ""))
        while True:
            query = f"FROM newest WHERE (stage, folder) > (?, ?) {where} ORDER BY stage, folder LIMIT {PAGE}"
            page = self._records(query, after if stage is None else (*after, quoted(stage)))
            yield from page
            if len(page) < PAGE:
                return
            after = (quoted(page[-1].stage), quoted(page[-1].unit))

    def units(self, stage: str, status: Status | None = None) -> list[str]:
        """Names of the units that have a record, sorted; those whose newest record has `status` where given."""
        where, values = ("", ()) if status is None else ("AND status = ?", (str(status),))
        query = f"SELECT unit FROM newest WHERE stage = ? {where} ORDER BY unit"
        return [unit for (unit,) in self._rows(query, (quoted(stage), *values))]

    def stages(self) -> list[str]:
        """Names of the stages that have records, sorted."""
        rows = self._rows("SELECT DISTINCT stage_name FROM files WHERE body IS NOT NULL ORDER BY 1")
        return [name for (name,) in rows]

    def count_by_status(self, stage: str) -> dict[Status, int]:
        """How many units have a newest record of each status; every status is a key."""
        query = "SELECT status, COUNT(*) FROM newest WHERE stage = ? GROUP BY status"
        rows = dict(self._rows(query, (quoted(stage),)))
        return {status: rows.get(str(status), 0) for status in Status}

    def count_files(self) -> int:
        """How many records and marks there are."""
        return int(self._rows("SELECT COUNT(*) FROM files")[0][0])

    def next_attempt(self, stage: str, unit: str) -> int:
        """One more than the highest attempt that has a record or a mark."""
        query = "SELECT MAX(attempt) FROM files WHERE stage = ? AND folder = ?"
        return (self._rows(query, (quoted(stage), quoted(unit)))[0][0] or 0) + 1

    def mean_seconds(self, stage: str) -> float | None:
        """Mean time of the units of a stage that gave a result, or None where there is none."""
        return self._mean(stage, "AVG(seconds)")

    def peak_mb(self, stage: str) -> float | None:
        """Highest memory of the units of a stage that gave a result, or None where there is none."""
        return self._mean(stage, "MAX(peak_mb)")

    def state(self, task: Task) -> State:
        """What has to be done about a task; see `State`."""
        key = (quoted(task.stage), quoted(task.unit))
        row = next(iter(self._rows(f"SELECT digest, attempt {NEWEST}", key)), None)
        query = "SELECT MAX(attempt) FROM files WHERE stage = ? AND folder = ? AND body IS NULL"
        mark = self._rows(query, key)[0][0]
        if mark is not None and (row is None or mark > row[1]):
            return State.SPOILED
        if row is None:
            return State.MISSING
        if row[0] != task.digest:
            return State.STALE
        record = self.latest(task.stage, task.unit)
        return State.DONE if record is not None and self._outputs.all_there(record) else State.LOST

    def _mean(self, stage: str, what: str) -> float | None:
        query = f"SELECT {what} FROM newest WHERE stage = ? AND status IN ('done', 'degraded')"
        value = self._rows(query, (quoted(stage),))[0][0]
        return None if value is None else float(value)

    @property
    def _database(self) -> sqlite3.Connection:
        if self._db is None:
            self._db = index.connect(self.store)
        return self._db

    def _sound(self, work: Callable[[], T]) -> T:
        """What `work` gives; from an index made anew where the one there turns out to be damaged."""
        try:
            try:
                return work()
            except Exception as error:
                if not index.is_damage(error):
                    raise
                self._make_anew()
                return work()
        except sqlite3.Error as error:
            remedy = "fix disk space and permissions there, or set XDG_CACHE_HOME to another folder"
            raise RunError(
                f"no index of the records can be kept ({error})", where=self.store.root, remedy=remedy
            ) from error

    def _make_anew(self) -> None:
        if self._db is not None:
            self._db.close()
        self._db = index.connect(self.store, anew=True)
        self._refreshed()

    def _checked(self) -> int:
        index.check_structure(self._database)
        return self._refreshed()

    def _rows(self, query: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        return self._sound(lambda: self._database.execute(query, values).fetchall())

    def _records(self, where: str, values: Sequence[Any]) -> list[Record]:
        def read() -> list[Record]:
            rows = self._database.execute(f"SELECT stage, folder, name, body_sum, body {where}", values)
            return [unpacked(*row) for row in rows.fetchall()]

        return self._sound(read)

    def _refreshed(self) -> int:
        new, stages = 0, self.store.folders(FOLDER)
        for stage in stages:
            found = {(folder, name): stamp for folder, name, stamp in self._files(stage)}
            known = self._known(stage)
            self._forget(stage, [key for key, stamp in known.items() if found.get(key) != stamp])
            new += self._take(stage, sorted((*k, s) for k, s in found.items() if known.get(k) != s))
        for (stage,) in self._database.execute("SELECT DISTINCT stage FROM files").fetchall():
            if stage not in stages:
                self._database.execute("DELETE FROM files WHERE stage = ?", (stage,))
        self._database.commit()
        return new

    def _files(self, stage: str) -> Iterator[tuple[str, str, str]]:
        """Folder, name and stamp of the records and marks of a stage."""
        for path, stamp in self.store.stamps(f"{FOLDER}/{stage}"):
            parts = path.split("/")
            if len(parts) == PARTS:
                yield parts[2], parts[3], "" if path.endswith(STARTED) else stamp

    def _known(self, stage: str) -> dict[tuple[str, str], str]:
        """Folder and name → stamp of what is indexed. Raises DamagedIndexError where a row is not what was written."""
        known = {}
        for *row, row_sum in self._database.execute(f"SELECT {COLUMNS}, row_sum FROM files WHERE stage = ?", (stage,)):
            if index.sum_of(tuple(row)) != row_sum:
                raise DamagedIndexError(f"{stage}/{row[1]}/{row[2]}")
            known[row[1], row[2]] = row[4]
        return known

    def _stamp(self, record: Record) -> str:
        return self.store.stamp(record_path(record.stage, record.unit, record.attempt), encode(record))

    def _forget(self, stage: str, gone: Iterable[tuple[str, str]]) -> None:
        query = "DELETE FROM files WHERE stage = ? AND folder = ? AND name = ?"
        self._database.executemany(query, [(stage, folder, name) for folder, name in gone])

    def _take(self, stage: str, files: list[tuple[str, str, str]]) -> int:
        self._insert_marks(stage, [file for file in files if file[1].endswith(STARTED)])
        stamps = {f"{FOLDER}/{stage}/{folder}/{name}": stamp for folder, name, stamp in files if name.endswith(".json")}
        read = self.store.read_many(stamps)
        taken = 0
        while batch := list(islice(read, BATCH)):
            found = ((readable_record(data, path), stamps[path]) for path, data in batch)
            taken += self._insert([(record, stamp) for record, stamp in found if record is not None])
        return taken

    def _insert_marks(self, stage: str, marks: Iterable[tuple[str, str, str]]) -> None:
        rows = [
            (stage, folder, name, attempt, stamp, *[None] * 7)
            for folder, name, stamp in marks
            if (attempt := attempt_of(name)) is not None
        ]
        self._database.executemany(INSERT, [(*row, index.sum_of(row), None) for row in rows])

    def _insert(self, records: Iterable[tuple[Record, str]]) -> int:
        rows = [row_of(record, stamp) for record, stamp in records]
        self._database.executemany(INSERT, rows)
        return len(rows)
