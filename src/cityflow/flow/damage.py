"""Compares files that a task reads with what was written: sizes always, contents where all of them are read anyway."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from cityflow.errors import RunError
from cityflow.flow.hashing import sha256_of, sha256_of_file

Written = tuple[int, str]
"""Bytes and SHA-256 of a file as its task left it."""

CHECKED = 20_000
"""Files that a process remembers as whole, some 300 bytes each."""
_CHECKED: dict[str, tuple[int, int, Written]] = {}


class DamagedFileError(RunError):
    """A file of the run is not what was written; the task that left it has to run again."""


class Known(Protocol):
    """Whoever knows what was written under a path; a mapping does."""

    def get(self, path: str, /) -> Written | None: ...


@dataclass(frozen=True, slots=True)
class ChainedKnown:
    """What the first knows, else the second."""

    first: Known
    second: Known

    def get(self, path: str, /) -> Written | None:
        found = self.first.get(path)
        return self.second.get(path) if found is None else found


@dataclass(frozen=True, slots=True)
class Damage:
    """What an attempt found instead of its inputs: RUN-relative path → what is wrong. It leaves no record."""

    files: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Expected:
    """What a reader may expect of a RUN's files; `found` collects what is not as expected, whatever the reader makes of it."""

    written: Known
    found: dict[str, str] = field(default_factory=dict)

    def check(self, path: str, data: bytes) -> None:
        """Raises DamagedFileError where `data` is not what was written under `path`."""
        written = self.written.get(path)
        if written is None:
            return
        if len(data) != written[0]:
            self._refuse(path, f"has {len(data)} bytes, {written[0]} were written")
        if sha256_of(data) != written[1]:
            self._refuse(path, "has changed since it was written")

    def check_file(self, path: str, file: Path | str, *, contents: bool) -> None:
        """The size, and the contents if asked for. Raises DamagedFileError."""
        written = self.written.get(path)
        if written is None:
            return
        if (size := Path(file).stat().st_size) != written[0]:
            self._refuse(path, f"has {size} bytes, {written[0]} were written")
        if contents and sha256_of_file(file) != written[1]:
            self._refuse(path, "has changed since it was written")

    def check_once(self, path: str, file: str) -> None:
        """Size and contents of a local file that others read, once a process as long as it stays as it is. Raises DamagedFileError."""
        written = self.written.get(path)
        if written is None:
            return
        try:
            about = os.stat(file)
        except FileNotFoundError:
            self.missing(path)
            return
        state = about.st_mtime_ns, about.st_ino, written
        if _CHECKED.get(file) == state:
            return
        if about.st_size != written[0]:
            self._refuse(path, f"has {about.st_size} bytes, {written[0]} were written")
        if sha256_of_file(file) != written[1]:
            self._refuse(path, "has changed since it was written")
        if len(_CHECKED) >= CHECKED:
            _CHECKED.clear()
        _CHECKED[file] = state

    def missing(self, path: str) -> None:
        """A file that is not there. Raises DamagedFileError where one was written."""
        if self.written.get(path) is not None:
            self._refuse(path, "is gone")

    def _refuse(self, path: str, problem: str) -> None:
        self.found[path] = problem
        raise DamagedFileError(problem, where=path, remedy="run again with --verify: the task that wrote it runs again")
