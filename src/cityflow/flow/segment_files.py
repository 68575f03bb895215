"""Reads segments: in place where the RUN is a local folder, else from copies in the user's cache folder."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from cityflow.flow.index import cache_path
from cityflow.flow.record_segments import FOLDER, LINES, TABLE, checksum, lines_path
from cityflow.flow.store import Store


@dataclass
class Files:
    """What there is of one segment: bytes of its records, None where they are gone; paths of its tables."""

    lines: int | None = None
    tables: list[str] = field(default_factory=list)


class SegmentFiles:
    """A copy is good as long as it is what its name says, which is its checksum."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._copies = None if store.is_local else cache_path(store).with_suffix(".segments")
        self._sound: set[str] = set()

    def listed(self) -> dict[str, Files]:
        """Segment → what there is of it, sorted."""
        found: dict[str, Files] = {}
        for path, size in sorted(self._store.sizes(FOLDER)):
            name = path.rsplit("/", 1)[1]
            if name.endswith((LINES, TABLE)):
                files = found.setdefault(name.split(".", 1)[0], Files())
                if name.endswith(LINES):
                    files.lines = size
                else:
                    files.tables.append(path)
        return found

    def tables(self, paths: Iterable[str]) -> Iterator[tuple[str, bytes]]:
        """Path and contents of tables, in some order."""
        absent = []
        for path in paths:
            data = self._copied(path, path.split(".")[-2])
            if data is None:
                absent.append(path)
            else:
                yield path, data
        for path, data in self._store.read_many(absent):
            self._keep(path, data, path.split(".")[-2])
            yield path, data

    def lines(self, name: str) -> bytes:
        """All records of a segment, as they stand in the RUN. Raises FileNotFoundError."""
        return self._store.read_bytes(lines_path(name))

    def piece(self, name: str, offset: int, length: int) -> bytes:
        """Some bytes of the records of a segment. Raises OSError where it is gone."""
        path = lines_path(name)
        copy = self._copy(path)
        if copy is not None and name not in self._sound:
            data = self._copied(path, name)
            if data is None:
                data = self._store.read_bytes(path)
                if not self._keep(path, data, name):
                    return data[offset : offset + length]
            self._sound.add(name)
        with open(copy or self._store.url(path), "rb") as file:
            return os.pread(file.fileno(), length, offset)

    def forget(self, kept: Iterable[str]) -> None:
        """Remove copies of segments that are no more."""
        if self._copies is None or not self._copies.is_dir():
            return
        names = set(kept)
        for copy in self._copies.iterdir():
            if copy.name.split(".", 1)[0] not in names:
                copy.unlink(missing_ok=True)

    def _copy(self, path: str) -> Path | None:
        return None if self._copies is None else self._copies / path.rsplit("/", 1)[1]

    def _copied(self, path: str, expected: str) -> bytes | None:
        """Contents of a copy, if there is a good one."""
        copy = self._copy(path)
        if copy is None or not copy.exists():
            return None
        data = copy.read_bytes()
        return data if checksum(data) == expected else None

    def _keep(self, path: str, data: bytes, expected: str) -> bool:
        """Keep a copy, if there is room for it and it is what its name says."""
        copy = self._copy(path)
        if copy is None or checksum(data) != expected:
            return False
        temporary = copy.with_name(f".{uuid.uuid4().hex}.partial")
        try:
            copy.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_bytes(data)
            temporary.replace(copy)
        except OSError:
            with suppress(OSError):
                temporary.unlink()
            return False
        return True
