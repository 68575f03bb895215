"""The SQLite file behind the ledger: where it lies, its tables, and when it is made anew."""

from __future__ import annotations

import os
import sqlite3
from hashlib import sha256
from pathlib import Path

from cityflow.flow.store import Store

VERSION = 1
"""Raised when the tables change; an index of another version is made anew."""

_TABLES = """
CREATE TABLE files (
  stage TEXT NOT NULL, folder TEXT NOT NULL, name TEXT NOT NULL, attempt INTEGER NOT NULL,
  stage_name TEXT, unit TEXT, digest TEXT, status TEXT, seconds REAL, peak_mb REAL, body BLOB,
  UNIQUE (stage, folder, name)
);
CREATE INDEX by_attempt ON files (stage, folder, attempt, body IS NULL, status);
CREATE VIEW newest AS SELECT * FROM files f WHERE body IS NOT NULL AND NOT EXISTS (
  SELECT 1 FROM files g WHERE g.stage = f.stage AND g.folder = f.folder AND g.body IS NOT NULL AND g.attempt > f.attempt
);
"""


def connect(store: Store, *, anew: bool = False) -> sqlite3.Connection:
    """A connection to the index of a RUN.

    ``RUN/ledger.sqlite`` where the RUN is local and writable, else a file of the user's cache folder named after the
    URL: SQLite does not work over an object store, and a reader of somebody else's RUN may not write there.
    """
    if store.is_local:
        try:
            return _opened(Path(store.root) / "ledger.sqlite", anew)
        except (sqlite3.OperationalError, OSError):
            pass
    return _opened(cache_path(store.root), anew)


def is_corrupt(error: sqlite3.DatabaseError) -> bool:
    """Whether the file is no sound database; its subclasses mean a lock, a full disk, or a mistake of ours."""
    return type(error) is sqlite3.DatabaseError


def cache_path(root: str) -> Path:
    """Where the index of a RUN lies that cannot hold it itself."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "cityflow" / "ledgers" / f"{sha256(root.encode()).hexdigest()[:24]}.sqlite"


def _opened(path: Path, anew: bool) -> sqlite3.Connection:
    if anew:
        _remove(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        return _prepared(path)
    except sqlite3.DatabaseError as error:
        if not is_corrupt(error):
            raise
        _remove(path)
        return _prepared(path)


def _prepared(path: Path) -> sqlite3.Connection:
    database = sqlite3.connect(path, timeout=60)
    try:
        _prepare(database)
    except sqlite3.Error:
        database.close()
        raise
    return database


def _prepare(database: sqlite3.Connection) -> None:
    # The records are the truth, so the index need not survive a power failure: no fsync. WAL keeps it whole when the
    # driver is killed, and lets `status` read while a run writes.
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA synchronous = OFF")
    version = database.execute("PRAGMA user_version").fetchone()[0]
    if version != VERSION:
        for kind, name in database.execute(
            "SELECT type, name FROM sqlite_master WHERE type IN ('table', 'view') AND name NOT LIKE 'sqlite_%'"
        ).fetchall():
            database.execute(f'DROP {kind} "{name}"')
        database.executescript(f"{_TABLES} PRAGMA user_version = {VERSION};")
    database.execute("BEGIN IMMEDIATE")  # fails here, not later, where the file is read-only
    database.rollback()


def _remove(path: Path) -> None:
    for suffix in ("", "-wal", "-shm"):
        Path(f"{path}{suffix}").unlink(missing_ok=True)
