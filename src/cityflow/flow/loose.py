"""Records that lie in files of their own, and marks: a SQLite index over them, rebuilt or completed from the files on opening."""

from __future__ import annotations

import sqlite3
import zlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple, TypeVar

from cityflow.errors import RunError
from cityflow.flow import index
from cityflow.flow.fresh import Fresh, Taken
from cityflow.flow.index_files import Keys, inserted, inserted_marks, taken_over
from cityflow.flow.ledger_rows import taken_of, unpacked
from cityflow.flow.records import FOLDER, mark_path, quoted, record_path
from cityflow.flow.row import NAMES, Row
from cityflow.flow.sealed import Sealed
from cityflow.flow.store import Store
from cityflow.flow.task import Record

ROW = ", ".join("stage_name" if name == "stage" else name for name in NAMES)

MOST_FRESH = 16_384
"""Records in memory before they go into the index: there are more than fill a segment only where none can be written. Set by hand."""

MOST_KEYS = 50_000
"""Units whose names are held in memory; there are more only where a RUN of an earlier version has no segments yet. Set by hand."""

TRIES = 5
"""To list and read files that another driver removes meanwhile, since they stand in a segment."""

T = TypeVar("T")


class Held(NamedTuple):
    """A record of the index, and its order among those of its unit."""

    attempt: int
    started: float
    record: Record


class Loose:
    """Belongs to the thread that opened it. Whatever is found to be wrong with the index is made anew from the files.

    Attributes
    ----------
    is_driver : new records stay in memory until they are joined, and what other processes have done is seen after each `commit`
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._db: sqlite3.Connection | None = None
        self._data_version = self._segments_version = self._keys_version = -1
        self._keys: Keys = set()
        self._fresh = Fresh()
        self.is_driver = self._has_asked = False

    def open(self) -> None:
        """Bring the index up to date. Raises RunError where there is no place for one."""
        self._sound(self._checked)

    def close(self) -> None:
        if self._db is not None:
            with suppress(sqlite3.Error, RunError):  # the records are written; the next opening completes the index
                self.settle()
                self._db.commit()
            self._db.close()

    def refresh(self) -> int:
        """Take over files that are new, forget those that are gone or changed; returns how many were new."""
        self.settle()
        return self._sound(self._refreshed)

    def commit(self) -> None:
        self._has_asked = False
        self._sound(self._database.commit)

    def add(self, record: Record, sealed: Sealed) -> None:
        self._fresh.add(Taken.of(record, sealed))
        if not self.is_driver or len(self._fresh) >= MOST_FRESH:
            self.settle()

    def settle(self) -> None:
        """Put what is in memory into the index."""
        if taken := self._fresh.emptied():
            rows = [(t, self._stamp(t)) for t in taken]
            self._keys.update(self._sound(lambda: inserted(self._database, rows)))

    def add_mark(self, stage: str, unit: str, attempt: int) -> None:
        name = mark_path(stage, unit, attempt).rsplit("/", 1)[1]
        marks = [(quoted(unit), name, "")]
        self._keys.update(self._sound(lambda: inserted_marks(self._database, quoted(stage), marks)))

    def of(self, stage: str, folder: str) -> list[Held]:
        """Records of a unit, newest first; names as they stand in paths."""
        query = (
            "SELECT attempt, started, stage, folder, name, body_sum, body FROM files "
            "WHERE stage = ? AND folder = ? AND body IS NOT NULL ORDER BY attempt DESC"
        )

        fresh = [Held(taken.row.attempt, taken.row.started, taken.record) for taken in self._fresh.of(stage, folder)]
        if self._lacks(stage, folder):
            return fresh

        def read() -> list[Held]:
            rows = self._database.execute(query, (stage, folder)).fetchall()
            return [Held(attempt, started, unpacked(*row)) for attempt, started, *row in rows]

        return sorted([*fresh, *self._sound(read)], key=lambda held: -held.attempt)

    def has(self, stage: str, folder: str) -> bool:
        """Whether a unit has a record here."""
        query = "SELECT 1 FROM files WHERE stage = ? AND folder = ? AND body IS NOT NULL LIMIT 1"
        return bool(self._fresh.of(stage, folder)) or (
            not self._lacks(stage, folder) and bool(self._rows(query, (stage, folder)))
        )

    def mark(self, stage: str, folder: str) -> int:
        """The highest attempt that has a mark, or 0."""
        query = "SELECT MAX(attempt) FROM files WHERE stage = ? AND folder = ? AND body IS NULL"
        return 0 if self._lacks(stage, folder) else self._rows(query, (stage, folder))[0][0] or 0

    def newest(self, stage: str | None = None) -> list[Row]:
        """The newest record of every unit, of one stage or all, in short."""
        self.settle()
        where, values = ("", ()) if stage is None else ("WHERE stage = ?", (quoted(stage),))
        return [Row.of_values(row) for row in self._rows(f"SELECT {ROW} FROM newest {where}", values)]

    def numbers(self) -> list[tuple[str, str, int]]:
        """Stage, folder and attempt of every record."""
        self.settle()
        return [(s, f, a) for s, f, a in self._rows("SELECT stage, folder, attempt FROM files WHERE body IS NOT NULL")]

    def open_marks(self) -> list[tuple[str, str, int]]:
        """Stage, folder and attempt of every unit's highest mark that no record here has overtaken."""
        query = (
            "SELECT stage, folder, MAX(attempt) FROM files m WHERE body IS NULL AND NOT EXISTS (SELECT 1 FROM files r WHERE r.stage = m.stage "
            "AND r.folder = m.folder AND r.body IS NOT NULL AND r.attempt >= m.attempt) GROUP BY stage, folder"
        )
        self.settle()
        return [(s, f, a) for s, f, a in self._rows(query)]

    def count(self) -> int:
        """How many records there are; one that is both in memory and in the index, which another process has completed, counts twice."""
        return int(self._rows("SELECT COUNT(*) FROM files WHERE body IS NOT NULL")[0][0]) + len(self._fresh)

    def oldest(self, most: int) -> list[Taken]:
        """Records in the order in which they came, to be joined."""
        query = f"SELECT {ROW}, digest, stage, folder, name, body_sum, body FROM files WHERE body IS NOT NULL ORDER BY rowid LIMIT ?"

        def read() -> list[Taken]:
            return [taken_of(row) for row in self._database.execute(query, (most,)).fetchall()]

        found = self._sound(read)
        return [*found, *self._fresh.oldest(most - len(found), [taken.row for taken in found])]

    def moved(self, records: Sequence[Taken], segments: Sequence[str]) -> list[str]:
        """Forget records that stand in segments now, and the marks of their attempts; the files that can go."""
        return self._sound(lambda: self._moved(records, segments))

    def apart(self, segments: Sequence[str]) -> None:
        """Forget segments that are no more."""
        rows = [(name,) for name in segments]
        self._sound(lambda: self._database.executemany("DELETE FROM segments WHERE name = ?", rows))

    def segments(self) -> set[str] | None:
        """Names of the segments that drivers have made of what was indexed here; None where nothing changed since the last question."""
        version = self._asked_version()
        if version == self._segments_version:
            return None
        self._segments_version = version
        return {name for (name,) in self._rows("SELECT name FROM segments")}

    def _lacks(self, stage: str, folder: str) -> bool:
        """Whether nothing of a unit is here, from memory: nearly all that a run asks for is new. False in doubt."""
        version = self._asked_version()
        if version != self._keys_version:
            self._keys = set(self._rows("SELECT stage, folder FROM files LIMIT ?", (MOST_KEYS,)))
            self._keys_version = version
        return len(self._keys) < MOST_KEYS and (stage, folder) not in self._keys

    def _asked_version(self) -> int:
        """Another number where another process has written into the index; a driver asks once between two commits."""
        if not (self.is_driver and self._has_asked):
            self._data_version = self._rows("PRAGMA data_version")[0][0]
            self._has_asked = True
        return self._data_version

    def _stamp(self, taken: Taken) -> str:
        row = taken.row
        return self._store.stamp(record_path(row.stage, row.unit, row.attempt), zlib.decompress(taken.body))

    @property
    def _database(self) -> sqlite3.Connection:
        if self._db is None:
            self._db = index.connect(self._store)
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
                f"no index of the records can be kept ({error})", where=self._store.root, remedy=remedy
            ) from error

    def _make_anew(self) -> None:
        if self._db is not None:
            self._db.close()
        self._db = index.connect(self._store, anew=True)
        self._segments_version = self._keys_version = -1
        self._has_asked = False
        self._fresh.emptied()
        self._refreshed()

    def _checked(self) -> int:
        index.check_structure(self._database)
        return self._refreshed()

    def _rows(self, query: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        return self._sound(lambda: self._database.execute(query, values).fetchall())

    def _refreshed(self) -> int:
        self._keys_version = -1
        for _ in range(TRIES - 1):
            with suppress(FileNotFoundError):
                return taken_over(self._store, self._database)
            self._database.rollback()
        return taken_over(self._store, self._database)

    def _moved(self, records: Sequence[Taken], segments: Sequence[str]) -> list[str]:
        database, paths, marks = self._database, list[str](), defaultdict[tuple[str, str], list[tuple[int, str]]](list)
        for stage, folder, attempt, name in database.execute(
            "SELECT stage, folder, attempt, name FROM files WHERE body IS NULL"
        ):
            marks[stage, folder].append((attempt, name))
        for row in (taken.row for taken in records):
            unit = quoted(row.stage), quoted(row.unit)
            paths.append(record_path(row.stage, row.unit, row.attempt))
            if unit in marks:
                begun = [name for attempt, name in marks[unit] if attempt <= row.attempt]
                paths.extend(f"{FOLDER}/{unit[0]}/{unit[1]}/{name}" for name in begun)
        # a driver's own records went by its memory alone
        if database.execute("SELECT 1 FROM files LIMIT 1").fetchone():
            gone = (path.split("/")[1:] for path in paths)
            database.executemany("DELETE FROM files WHERE stage = ? AND folder = ? AND name = ?", gone)
        self._fresh.drop(taken.row for taken in records)
        self._keys_version = -1
        database.executemany("INSERT OR REPLACE INTO segments VALUES (?)", [(name,) for name in segments])
        database.commit()
        return paths
