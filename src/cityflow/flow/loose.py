"""Records that lie in files of their own, and marks: a SQLite index over them, rebuilt or completed from the files on opening."""

from __future__ import annotations

import sqlite3
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from typing import Any, NamedTuple, TypeVar

from cityflow.errors import RunError
from cityflow.flow import index
from cityflow.flow.index import COLUMNS, DamagedIndexError
from cityflow.flow.ledger_rows import INSERT, attempt_of, line_of, readable_record, row_values, unpacked
from cityflow.flow.records import FOLDER, STARTED, mark_path, quoted, record_path
from cityflow.flow.row import NAMES, Line, Row
from cityflow.flow.sealed import Sealed
from cityflow.flow.store import Store
from cityflow.flow.task import Record

BATCH = 2000

PARTS = 4
"""Of the path of a record: ``records/<stage>/<unit>/<attempt>.json``."""

ROW = ", ".join("stage_name" if name == "stage" else name for name in NAMES)

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
    """Belongs to the thread that opened it. Whatever is found to be wrong with the index is made anew from the files."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._db: sqlite3.Connection | None = None
        self._version = self._keys_version = -1
        self._keys: set[tuple[str, str]] = set()

    def open(self) -> None:
        """Bring the index up to date. Raises RunError where there is no place for one."""
        self._sound(self._checked)

    def close(self) -> None:
        if self._db is not None:
            with suppress(sqlite3.Error):  # the records are written; the next opening completes the index
                self._db.commit()
            self._db.close()

    def refresh(self) -> int:
        """Take over files that are new, forget those that are gone or changed; returns how many were new."""
        return self._sound(self._refreshed)

    def commit(self) -> None:
        self._sound(self._database.commit)

    def add(self, record: Record, sealed: Sealed) -> None:
        stamp = self._store.stamp(record_path(record.stage, record.unit, record.attempt), sealed.text)
        self._sound(lambda: self._insert([(record, sealed, stamp)]))

    def add_mark(self, stage: str, unit: str, attempt: int) -> None:
        name = mark_path(stage, unit, attempt).rsplit("/", 1)[1]
        self._sound(lambda: self._insert_marks(quoted(stage), [(quoted(unit), name, "")]))

    def of(self, stage: str, folder: str) -> list[Held]:
        """Records of a unit, newest first; names as they stand in paths."""
        query = (
            "SELECT attempt, started, stage, folder, name, body_sum, body FROM files "
            "WHERE stage = ? AND folder = ? AND body IS NOT NULL ORDER BY attempt DESC"
        )

        if self._lacks(stage, folder):
            return []

        def read() -> list[Held]:
            rows = self._database.execute(query, (stage, folder)).fetchall()
            return [Held(attempt, started, unpacked(*row)) for attempt, started, *row in rows]

        return self._sound(read)

    def has(self, stage: str, folder: str) -> bool:
        """Whether a unit has a record here."""
        query = "SELECT 1 FROM files WHERE stage = ? AND folder = ? AND body IS NOT NULL LIMIT 1"
        return not self._lacks(stage, folder) and bool(self._rows(query, (stage, folder)))

    def mark(self, stage: str, folder: str) -> int:
        """The highest attempt that has a mark, or 0."""
        query = "SELECT MAX(attempt) FROM files WHERE stage = ? AND folder = ? AND body IS NULL"
        return 0 if self._lacks(stage, folder) else self._rows(query, (stage, folder))[0][0] or 0

    def newest(self, stage: str | None = None) -> list[Row]:
        """The newest record of every unit, of one stage or all, in short."""
        where, values = ("", ()) if stage is None else ("WHERE stage = ?", (quoted(stage),))
        return [Row.of_values(row) for row in self._rows(f"SELECT {ROW} FROM newest {where}", values)]

    def numbers(self) -> list[tuple[str, str, int]]:
        """Stage, folder and attempt of every record."""
        return [(s, f, a) for s, f, a in self._rows("SELECT stage, folder, attempt FROM files WHERE body IS NOT NULL")]

    def open_marks(self) -> list[tuple[str, str, int]]:
        """Stage, folder and attempt of every unit's highest mark that no record here has overtaken."""
        query = (
            "SELECT stage, folder, MAX(attempt) FROM files m WHERE body IS NULL AND NOT EXISTS (SELECT 1 FROM files r WHERE r.stage = m.stage "
            "AND r.folder = m.folder AND r.body IS NOT NULL AND r.attempt >= m.attempt) GROUP BY stage, folder"
        )
        return [(s, f, a) for s, f, a in self._rows(query)]

    def count(self) -> int:
        """How many records there are."""
        return int(self._rows("SELECT COUNT(*) FROM files WHERE body IS NOT NULL")[0][0])

    def oldest(self, most: int) -> list[Line]:
        """Records in the order in which they came, to be joined."""
        query = f"SELECT {ROW}, digest, stage, folder, name, body_sum, body FROM files WHERE body IS NOT NULL ORDER BY rowid LIMIT ?"

        def read() -> list[Line]:
            return [line_of(row) for row in self._database.execute(query, (most,)).fetchall()]

        return self._sound(read)

    def moved(self, lines: Sequence[Line], segments: Sequence[str]) -> list[str]:
        """Forget records that stand in segments now, and the marks of their attempts; the files that can go."""
        return self._sound(lambda: self._moved(lines, segments))

    def apart(self, segments: Sequence[str]) -> None:
        """Forget segments that are no more."""
        rows = [(name,) for name in segments]
        self._sound(lambda: self._database.executemany("DELETE FROM segments WHERE name = ?", rows))

    def segments(self) -> set[str] | None:
        """Names of the segments that drivers have made of what was indexed here; None where nothing changed since the last question."""
        version = self._rows("PRAGMA data_version")[0][0]
        if version == self._version:
            return None
        self._version = version
        return {name for (name,) in self._rows("SELECT name FROM segments")}

    def _lacks(self, stage: str, folder: str) -> bool:
        """Whether nothing of a unit is here, from memory: nearly all that a run asks for is new. False in doubt."""
        version = self._rows("PRAGMA data_version")[0][0]
        if version != self._keys_version:
            self._keys = set(self._rows("SELECT stage, folder FROM files LIMIT ?", (MOST_KEYS,)))
            self._keys_version = version
        return len(self._keys) < MOST_KEYS and (stage, folder) not in self._keys

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
        self._version = self._keys_version = -1
        self._refreshed()

    def _checked(self) -> int:
        index.check_structure(self._database)
        return self._refreshed()

    def _rows(self, query: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        return self._sound(lambda: self._database.execute(query, values).fetchall())

    def _refreshed(self) -> int:
        for _ in range(TRIES - 1):
            with suppress(FileNotFoundError):
                return self._listed()
            self._database.rollback()
        return self._listed()

    def _listed(self) -> int:
        new, stages = 0, self._store.folders(FOLDER)
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
        for path, stamp in self._store.stamps(f"{FOLDER}/{stage}"):
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

    def _forget(self, stage: str, gone: Iterable[tuple[str, str]]) -> None:
        query = "DELETE FROM files WHERE stage = ? AND folder = ? AND name = ?"
        self._database.executemany(query, [(stage, folder, name) for folder, name in gone])

    def _moved(self, lines: Sequence[Line], segments: Sequence[str]) -> list[str]:
        database, paths, marks = self._database, list[str](), defaultdict[tuple[str, str], list[tuple[int, str]]](list)
        for stage, folder, attempt, name in database.execute(
            "SELECT stage, folder, attempt, name FROM files WHERE body IS NULL"
        ):
            marks[stage, folder].append((attempt, name))
        for line in lines:
            paths.append(record_path(line.row.stage, line.row.unit, line.row.attempt))
            unit = quoted(line.row.stage), quoted(line.row.unit)
            begun = [name for attempt, name in marks.get(unit, ()) if attempt <= line.row.attempt]
            paths.extend(f"{FOLDER}/{unit[0]}/{unit[1]}/{name}" for name in begun)
        gone = [path.split("/")[1:] for path in paths]
        database.executemany("DELETE FROM files WHERE stage = ? AND folder = ? AND name = ?", gone)
        self._keys_version = -1
        database.executemany("INSERT OR REPLACE INTO segments VALUES (?)", [(name,) for name in segments])
        database.commit()
        return paths

    def _take(self, stage: str, files: list[tuple[str, str, str]]) -> int:
        self._insert_marks(stage, [file for file in files if file[1].endswith(STARTED)])
        stamps = {f"{FOLDER}/{stage}/{folder}/{name}": stamp for folder, name, stamp in files if name.endswith(".json")}
        read = self._store.read_many(stamps)
        taken = 0
        while batch := list(islice(read, BATCH)):
            found = ((readable_record(data, path), data, stamps[path]) for path, data in batch)
            taken += self._insert([(r, Sealed.of_text(data, r), stamp) for r, data, stamp in found if r is not None])
        return taken

    def _insert_marks(self, stage: str, marks: Sequence[tuple[str, str, str]]) -> None:
        rows = [
            (stage, folder, name, attempt, stamp, *[None] * 10)
            for folder, name, stamp in marks
            if (attempt := attempt_of(name)) is not None
        ]
        self._database.executemany(INSERT, [(*row, index.sum_of(row), None) for row in rows])
        self._keys.update((stage, folder) for folder, _, _ in marks)

    def _insert(self, records: Iterable[tuple[Record, Sealed, str]]) -> int:
        rows = [row_values(*each) for each in records]
        self._database.executemany(INSERT, rows)
        self._keys.update(row[:2] for row in rows)
        return len(rows)
