"""What was read of files before, in one file beside the catalog, so that an interrupted command goes on where it stopped."""

from __future__ import annotations

import hashlib
import sqlite3
import time
from contextlib import suppress
from pathlib import Path

import fsspec

from cityflow.errors import CatalogError

A_COMMIT_S = 2.0
"""Seconds of reading that an interruption loses at most."""


class KeptAnswers:
    """Answers by a text that says what was asked of which file; without a path nothing is kept. The file is made when something is asked for."""

    def __init__(self, path: Path | None = None) -> None:
        self._path = path
        self._open: sqlite3.Connection | None = None
        self._committed = 0.0

    def __enter__(self) -> KeptAnswers:
        return self

    def __exit__(self, *_: object) -> None:
        if self._open is not None:
            self.commit()
            self._open.close()

    def get(self, key: str) -> bytes | None:
        """What `put` was given.

        Raises
        ------
        CatalogError
            The file is no such thing, or another command uses it.
        """
        if self._path is None:
            return None
        if self._open is None:
            self._open = _opened(self._path)
        row = self._open.execute("SELECT answer FROM answers WHERE key = ?", (_short(key),)).fetchone()
        return row[0] if row else None

    def put(self, key: str, answer: bytes) -> None:
        """Keep an answer that `get` did not know."""
        if self._open is None:
            return
        self._open.execute("INSERT OR REPLACE INTO answers VALUES (?, ?)", (_short(key), answer))
        if time.monotonic() - self._committed > A_COMMIT_S:
            self.commit()

    def commit(self) -> None:
        """Make sure that it outlives this process."""
        if self._open is not None:
            self._open.commit()
            self._committed = time.monotonic()


def _opened(path: Path) -> sqlite3.Connection:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        found = sqlite3.connect(path, timeout=1.0)
        # held until it is closed: two commands that make the same catalog would wait for each other in the middle
        found.execute("PRAGMA locking_mode = EXCLUSIVE")
        found.execute("BEGIN EXCLUSIVE")
        found.execute("CREATE TABLE IF NOT EXISTS answers (key BLOB PRIMARY KEY, answer BLOB) WITHOUT ROWID")
        found.commit()
    except (sqlite3.Error, OSError) as error:
        remedy = "end the other command that makes this catalog, or delete the file"
        raise CatalogError(
            f"what was read before cannot be opened ({error})", where=str(path), remedy=remedy
        ) from error
    return found


def _short(key: str) -> bytes:
    return hashlib.sha256(key.encode()).digest()


def state_of(path: str) -> str:
    """Size and time of change of a file, or what its store knows it by; empty where neither is known."""
    with suppress(Exception):  # every store has exceptions of its own; whoever reads the file says better what is wrong
        if "://" in path:
            fs, place = fsspec.core.url_to_fs(path)
            return str(fs.ukey(place))
        status = Path(path).stat()
        return f"{status.st_size} {status.st_mtime_ns}"
    return ""
