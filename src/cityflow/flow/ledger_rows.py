"""Records as rows of the ledger's database."""

from __future__ import annotations

import zlib
from typing import Any

from cityflow.flow import index
from cityflow.flow.index import COLUMNS, DamagedIndexError
from cityflow.flow.records import decode, encode, quoted, record_path
from cityflow.flow.task import Record

NEWEST = "FROM files WHERE stage = ? AND folder = ? AND body IS NOT NULL ORDER BY attempt DESC LIMIT 1"
INSERT = f"INSERT OR REPLACE INTO files ({COLUMNS}, row_sum, body) VALUES ({', '.join('?' * 14)})"


def row_of(record: Record, stamp: str) -> tuple[Any, ...]:
    stage, folder, name = quoted(record.stage), quoted(record.unit), f"{record.attempt:04d}.json"
    body = zlib.compress(encode(record), 1)
    indexed = (
        record.stage,
        record.unit,
        record.digest,
        str(record.status),
        float(record.seconds),
        float(record.peak_mb),
    )
    row = (stage, folder, name, record.attempt, stamp, *indexed, zlib.crc32(body))
    return (*row, index.sum_of(row), body)


def unpacked(stage: str, folder: str, name: str, body_sum: int, body: bytes) -> Record:
    if zlib.crc32(body) != body_sum:
        raise DamagedIndexError(f"{stage}/{folder}/{name}")
    return decode(zlib.decompress(body))


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
