"""Records that a driver has taken in and not joined yet, in memory: an index need not have them, since their files are there."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from itertools import islice
from typing import NamedTuple

from cityflow.flow.records import decode, quoted
from cityflow.flow.row import Line, Row, row_of
from cityflow.flow.sealed import Sealed
from cityflow.flow.task import Record


class Taken(NamedTuple):
    """A record in short, the digest of its task, and its text, compressed."""

    row: Row
    digest: str
    body: bytes

    @classmethod
    def of(cls, record: Record, sealed: Sealed) -> Taken:
        return cls(row_of(record), record.digest, sealed.body)

    @property
    def line(self) -> Line:
        """To be joined."""
        return Line(self.row, self.digest, zlib.decompress(self.body))

    @property
    def record(self) -> Record:
        """The whole record."""
        return decode(zlib.decompress(self.body))


class Fresh:
    """Records in the order in which they came, some kilobytes each; names of units as they stand in paths."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str, int], Taken] = {}
        self._highest: dict[tuple[str, str], int] = {}

    def __len__(self) -> int:
        return len(self._found)

    def add(self, taken: Taken) -> None:
        stage, folder, attempt = _key(taken.row)
        self._highest[stage, folder] = max(attempt, self._highest.get((stage, folder), 0))
        self._found[stage, folder, attempt] = taken

    def of(self, stage: str, folder: str) -> list[Taken]:
        """Those of a unit, newest first."""
        highest = self._highest.get((stage, folder), 0)
        return [taken for a in range(highest, 0, -1) if (taken := self._found.get((stage, folder, a))) is not None]

    def oldest(self, most: int, without: Iterable[Row]) -> list[Taken]:
        """In the order in which they came, but for some."""
        others = {_key(row) for row in without}
        return [*islice((t for key, t in self._found.items() if key not in others), most)]

    def drop(self, rows: Iterable[Row]) -> None:
        """They stand elsewhere now."""
        for row in rows:
            stage, folder, attempt = _key(row)
            self._found.pop((stage, folder, attempt), None)
            if self._highest.get((stage, folder)) == attempt:
                del self._highest[stage, folder]

    def emptied(self) -> list[Taken]:
        """All of them; none is left."""
        found = list(self._found.values())
        self._found.clear()
        self._highest.clear()
        return found


def _key(row: Row) -> tuple[str, str, int]:
    return quoted(row.stage), quoted(row.unit), row.attempt
