"""The SQLite file behind the ledger: location, tables, detection of damage."""

from __future__ import annotations

import os
import sqlite3
import zlib
from hashlib import sha256
from pathlib import Path
from typing import Any

from cityflow.flow.store import Store

VERSION = 3
"""Raised when the tables change; an index of another version is made anew."""

COLUMNS = "stage, folder, name, attempt, stamp, stage_name, unit, digest, status, reason, verdict, seconds, peak_mb, started, body_sum"
"""All but the record itself, and the checksum of these."""

PATIENCE_S = 60.0
"""How long one command waits while another one writes."""

_TABLES = """
CREATE TABLE files (
  stage TEXT NOT NULL, folder TEXT NOT NULL, name TEXT NOT NULL, attempt INTEGER NOT NULL, stamp TEXT NOT NULL,
  stage_name TEXT, unit TEXT, digest TEXT, status TEXT, reason TEXT, verdict TEXT, seconds REAL, peak_mb REAL, started REAL,
  body_sum INTEGER, row_sum INTEGER, body BLOB,
  UNIQUE (stage, folder, name)
);
CREATE TABLE segments (name TEXT PRIMARY KEY);
CREATE INDEX by_attempt ON files (stage, folder, attempt, body IS NULL, status);
CREATE VIEW newest AS SELECT * FROM files f WHERE body IS NOT NULL AND NOT EXISTS (
  SELECT 1 FROM files g WHERE g.stage = f.stage AND g.folder = f.folder AND g.body IS NOT NULL AND g.attempt > f.attempt
);
"""

FILE = "ledger.sqlite"
"""In a local RUN."""
_ELSEWHERE = (
    sqlite3.SQLITE_BUSY,
    sqlite3.SQLITE_LOCKED,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_NOMEM,
    sqlite3.SQLITE_INTERRUPT,
)
"""What SQLite says when not the file is to blame."""


class DamagedIndexError(Exception):
    """The index is not what was written into it."""


def connect(store: Store, *, anew: bool = False) -> sqlite3.Connection:
    """A connection to the index of a RUN; `anew` removes what is there.

    ``RUN/ledger.sqlite`` where the RUN is local and writable, else a file of the user's cache folder named after the
    URL and the endpoint (two clusters may have the same ``s3://bucket/path``): SQLite does not work over an object
    store, and a reader of somebody else's RUN may not write there.

    Raises
    ------
    sqlite3.Error, OSError : neither can be used
    """
    if store.is_local:
        try:
            return _opened(Path(store.root) / FILE, anew)
        except (sqlite3.Error, OSError):
            pass
    return _opened(cache_path(store), anew)


def is_damage(error: Exception) -> bool:
    """Whether an error may come of a damaged file, and not of a lock, a full disk or a lack of memory.

    A flipped bit can look like nearly anything: a table that is not there, a text that is none, a file of a later format.
    """
    if isinstance(error, sqlite3.ProgrammingError):
        return False  # a closed connection, or another thread's
    if isinstance(error, sqlite3.Error):
        return getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF not in _ELSEWHERE
    return isinstance(error, DamagedIndexError | ValueError | TypeError | KeyError | OverflowError | zlib.error)


def check_structure(database: sqlite3.Connection) -> None:
    """Hold pages, order and indices against each other. Raises DamagedIndexError, sqlite3.Error."""
    found = database.execute("PRAGMA integrity_check(1)").fetchall()
    if found != [("ok",)]:
        raise DamagedIndexError(str(found))


def sum_of(row: tuple[Any, ...]) -> int:
    """Checksum of the values of `COLUMNS`."""
    return zlib.crc32(repr(row).encode())


def cache_path(store: Store) -> Path:
    """Where the index of a RUN lies that cannot hold it itself."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "cityflow" / "ledgers" / f"{sha256(store.address.encode()).hexdigest()[:24]}.sqlite"


def _opened(path: Path, anew: bool) -> sqlite3.Connection:
    if anew:
        _remove(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        return _prepared(path)
    except sqlite3.Error as error:
        if not is_damage(error):
            raise
        _remove(path)
        return _prepared(path)


def _prepared(path: Path) -> sqlite3.Connection:
    database = sqlite3.connect(path, timeout=PATIENCE_S)
    try:
        _prepare(database)
    except BaseException:
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
