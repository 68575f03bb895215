"""Records as files: ``records/<stage>/<unit>/<attempt>.json``, and the marks of attempts that write in place."""

from __future__ import annotations

import json
from dataclasses import fields
from hashlib import sha256
from typing import Any
from urllib.parse import quote, unquote

from cityflow.core.building import Status
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record

FOLDER = "records"
STARTED = ".started"
MAX_NAME_BYTES = 180
"""File systems take 255 bytes; the rest is for suffixes."""


def quoted(name: str) -> str:
    """A file name for any id: percent-encoded, reversible by `unquoted` up to 180 bytes, beyond that cut and hashed.

    >>> quoted("NL.IMBAG:0503/Pand é"), unquoted(quoted("NL.IMBAG:0503/Pand é"))
    ('NL.IMBAG%3A0503%2FPand%20%C3%A9', 'NL.IMBAG:0503/Pand é')
    >>> quoted(".."), quoted("")
    ('%2E.', '%')
    """
    text = quote(name, safe="") or "%"
    if text.startswith("."):
        text = "%2E" + text[1:]
    if len(text) <= MAX_NAME_BYTES:
        return text
    return f"{text[: MAX_NAME_BYTES - 34]}%~{sha256(name.encode()).hexdigest()[:32]}"


def unquoted(text: str) -> str:
    """Inverse of `quoted`."""
    return "" if text == "%" else unquote(text)


def unit_folder(stage: str, unit: str) -> str:
    return f"{FOLDER}/{quoted(stage)}/{quoted(unit)}"


def record_path(stage: str, unit: str, attempt: int) -> str:
    """Where the record of an attempt lies, relative to the RUN."""
    return f"{unit_folder(stage, unit)}/{attempt:04d}.json"


def mark_path(stage: str, unit: str, attempt: int) -> str:
    """Where the mark lies that an attempt has started to write in place."""
    return f"{unit_folder(stage, unit)}/{attempt:04d}{STARTED}"


def write_record(store: Store, record: Record) -> str:
    """Write a record and return its path."""
    path = record_path(record.stage, record.unit, record.attempt)
    store.write_bytes(path, encode(record))
    return path


def write_mark(store: Store, stage: str, unit: str, attempt: int) -> None:
    store.write_bytes(mark_path(stage, unit, attempt), b"")


def read_record(store: Store, stage: str, unit: str, attempt: int) -> Record | None:
    """The record of an attempt, or None where there is none or it was cut short by a crash of the machine."""
    try:
        return decode(store.read_bytes(record_path(stage, unit, attempt)))
    except (FileNotFoundError, ValueError):
        return None


def encode(record: Record) -> bytes:
    """JSON text, one line, keys in the order of the fields."""
    return _json({name: getattr(record, name) for name in _NAMES}).encode()


def decode(data: bytes) -> Record:
    """Inverse of `encode`; fields of later versions are ignored. Raises ValueError for what is no record."""
    value = json.loads(data)
    if not isinstance(value, dict) or any(name not in value for name in _REQUIRED):
        raise ValueError("not a record")
    known = {name: value[name] for name in _NAMES if name in value}
    return Record(**{**known, "status": Status(known["status"])})


def plain_outcome(outcome: Outcome) -> Outcome:
    """The same outcome made of what JSON gives back, so that a fresh record equals one that was read.

    Raises
    ------
    TypeError, ValueError : something in it is no JSON value (an array, a NaN)
    """
    values = json.loads(_json([str(outcome.status), outcome.reason, outcome.outputs, outcome.result]))
    return Outcome(Status(values[0]), *values[1:])


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, default=_plain, allow_nan=False)


def _plain(value: Any) -> Any:
    """numpy scalars as Python's; anything else is no JSON."""
    if hasattr(value, "item") and getattr(value, "ndim", None) == 0:
        return value.item()
    if hasattr(value, "keys"):
        return dict(value)
    raise TypeError(f"{type(value).__name__} is no JSON value: {value!r:.100}")


_NAMES = tuple(field.name for field in fields(Record))
_REQUIRED = ("stage", "unit", "attempt", "digest", "version", "status", "reason", "outputs", "result")
