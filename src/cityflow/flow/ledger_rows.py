"""Records as rows of the index's database."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Any

from cityflow.flow import index
from cityflow.flow.fresh import Taken
from cityflow.flow.index import COLUMNS, DamagedIndexError
from cityflow.flow.records import decode, quoted, record_path
from cityflow.flow.row import NAMES, Row
from cityflow.flow.task import Record

INSERT = f"INSERT OR REPLACE INTO files ({COLUMNS}, row_sum, body) VALUES ({', '.join('?' * 17)})"


def row_values(taken: Taken, stamp: str) -> tuple[Any, ...]:
    row, body = taken.row, taken.body
    name = f"{row.attempt:04d}.json"
    values = (quoted(row.stage), quoted(row.unit), name, row.attempt, stamp, row.stage, row.unit, taken.digest,
              str(row.status), row.reason, row.verdict, row.seconds, row.peak_mb, row.started, zlib.crc32(body))  # fmt: skip
    return (*values, index.sum_of(values), body)


def taken_of(values: Sequence[Any]) -> Taken:
    """What `Loose.oldest` selects. Raises DamagedIndexError."""
    digest, *where = values[len(NAMES) :]
    return Taken(Row.of_values(values[: len(NAMES)]), digest, _sound(*where))


def unpacked(stage: str, folder: str, name: str, body_sum: int, body: bytes) -> Record:
    """Raises DamagedIndexError."""
    return decode(zlib.decompress(_sound(stage, folder, name, body_sum, body)))


def readable_record(data: bytes, path: str) -> Record | None:
    """A record cut short by a crash of the machine, changed since, or in another's place counts as not written."""
    try:
        record = decode(data)
    except ValueError:
        return None
    return record if record_path(record.stage, record.unit, record.attempt) == path else None


def attempt_of(name: str) -> int | None:
    digits = name.split(".", 1)[0]
    return int(digits) if digits.isdigit() else None


def _sound(stage: str, folder: str, name: str, body_sum: int, body: bytes) -> bytes:
    """The compressed text of a record, as it was indexed."""
    if zlib.crc32(body) != body_sum:
        raise DamagedIndexError(f"{stage}/{folder}/{name}")
    return body
