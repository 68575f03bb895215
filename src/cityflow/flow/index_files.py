"""Brings the index up to date with the files of records and marks."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

from cityflow.flow import index
from cityflow.flow.fresh import Taken
from cityflow.flow.index import COLUMNS, DamagedIndexError
from cityflow.flow.ledger_rows import INSERT, attempt_of, readable_record, row_values
from cityflow.flow.records import FOLDER, STARTED
from cityflow.flow.sealed import Sealed
from cityflow.flow.store import Store

BATCH = 2000

PARTS = 4
"""Of the path of a record: ``records/<stage>/<unit>/<attempt>.json``."""

Keys = set[tuple[str, str]]
"""Stage and unit as they stand in paths."""


def taken_over(store: Store, database: sqlite3.Connection) -> int:
    """Take over files that are new, forget those that are gone or changed, and commit; returns how many were new.

    Raises
    ------
    DamagedIndexError : a row is not what was written
    FileNotFoundError : another driver has removed a file meanwhile
    """
    new, stages = 0, store.folders(FOLDER)
    for stage in stages:
        found = {(folder, name): stamp for folder, name, stamp in _files(store, stage)}
        known = _known(database, stage)
        _forget(database, stage, [key for key, stamp in known.items() if found.get(key) != stamp])
        new += _take(store, database, stage, sorted((*k, s) for k, s in found.items() if known.get(k) != s))
    for (stage,) in database.execute("SELECT DISTINCT stage FROM files").fetchall():
        if stage not in stages:
            database.execute("DELETE FROM files WHERE stage = ?", (stage,))
    database.commit()
    return new


def inserted(database: sqlite3.Connection, records: Iterable[tuple[Taken, str]]) -> Keys:
    """Put records into the index, each with the stamp of its file; returns their units."""
    rows = [row_values(*each) for each in records]
    database.executemany(INSERT, rows)
    return {row[:2] for row in rows}


def inserted_marks(database: sqlite3.Connection, stage: str, marks: Sequence[tuple[str, str, str]]) -> Keys:
    """The same of marks: folder, name and stamp."""
    rows = [
        (stage, folder, name, attempt, stamp, *[None] * 10)
        for folder, name, stamp in marks
        if (attempt := attempt_of(name)) is not None
    ]
    database.executemany(INSERT, [(*row, index.sum_of(row), None) for row in rows])
    return {(stage, folder) for folder, _, _ in marks}


def _files(store: Store, stage: str) -> Iterator[tuple[str, str, str]]:
    """Folder, name and stamp of the records and marks of a stage."""
    for path, stamp in store.stamps(f"{FOLDER}/{stage}"):
        parts = path.split("/")
        if len(parts) == PARTS:
            yield parts[2], parts[3], "" if path.endswith(STARTED) else stamp


def _known(database: sqlite3.Connection, stage: str) -> dict[tuple[str, str], str]:
    """Folder and name → stamp of what is indexed. Raises DamagedIndexError where a row is not what was written."""
    known = {}
    for *row, row_sum in database.execute(f"SELECT {COLUMNS}, row_sum FROM files WHERE stage = ?", (stage,)):
        if index.sum_of(tuple(row)) != row_sum:
            raise DamagedIndexError(f"{stage}/{row[1]}/{row[2]}")
        known[row[1], row[2]] = row[4]
    return known


def _forget(database: sqlite3.Connection, stage: str, gone: Iterable[tuple[str, str]]) -> None:
    query = "DELETE FROM files WHERE stage = ? AND folder = ? AND name = ?"
    database.executemany(query, [(stage, folder, name) for folder, name in gone])


def _take(store: Store, database: sqlite3.Connection, stage: str, files: list[tuple[str, str, str]]) -> int:
    inserted_marks(database, stage, [file for file in files if file[1].endswith(STARTED)])
    stamps = {f"{FOLDER}/{stage}/{folder}/{name}": stamp for folder, name, stamp in files if name.endswith(".json")}
    read = store.read_many(stamps)
    taken = 0
    while batch := list(islice(read, BATCH)):
        found = ((readable_record(data, path), data, stamps[path]) for path, data in batch)
        rows = [(Taken.of(r, Sealed.of_text(data, r)), stamp) for r, data, stamp in found if r is not None]
        inserted(database, rows)
        taken += len(rows)
    return taken
