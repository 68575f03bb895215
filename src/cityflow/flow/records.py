"""Records as files: ``records/<stage>/<unit>/<attempt>.json``, and the marks of attempts that write in place."""

from __future__ import annotations

import json
import re
from dataclasses import MISSING, fields
from functools import lru_cache
from hashlib import sha256
from types import UnionType
from typing import Any
from urllib.parse import quote, unquote

from pydantic_core import from_json

from cityflow.core.unit_status import Status
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Record

FOLDER = "records"
STARTED = ".started"
CHECK_DIGITS = 16
"""Of the SHA-256 at the end of a record: enough to tell damage, which nobody intends."""

MAX_NAME_BYTES = 180
"""File systems take 255 bytes; the rest is for suffixes."""


@lru_cache(maxsize=10_000)
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


def newest_file(store: Store, stage: str, unit: str) -> Record | None:
    """The newest record of a unit that is a file of its own, whether or not a driver has put it in the ledger's index; None where there is none."""
    names = [
        p.rsplit("/", 1)[-1].removesuffix(".json") for p in store.find(unit_folder(stage, unit)) if p.endswith(".json")
    ]
    newest = max((int(n) for n in names if n.isdecimal()), default=0)
    return read_record(store, stage, unit, newest)


def encode(record: Record) -> bytes:
    """JSON text, one line, keys in the order of the fields; at its end a checksum of all before it."""
    text = _json({name: getattr(record, name) for name in _NAMES}).encode()
    return text[:-1] + _CHECK % sha256(text).hexdigest()[:CHECK_DIGITS].encode()


def decode(data: bytes) -> Record:
    """Inverse of `encode`; fields of later versions are ignored. Raises ValueError for what is no record, or was changed since."""
    if (sealed := _SEALED.search(data)) is not None:
        text = data[: sealed.start()] + b"}"
        if sha256(text).hexdigest()[:CHECK_DIGITS].encode() != sealed[1]:
            raise ValueError("its checksum is wrong")
    return parsed(data)


def parsed(data: bytes) -> Record:
    """The same of a text that is known to be whole."""
    value = from_json(data)
    if not isinstance(value, dict) or any(name not in value for name in _REQUIRED):
        raise ValueError("not a record")
    known = {name: value[name] for name in _NAMES if name in value}
    record = Record(**{**known, "status": Status(known["status"])})
    if any(not isinstance(getattr(record, name), kind) for name, kind in _KINDS.items()):
        raise ValueError("not a record")
    return record


def plain_outcome(outcome: Outcome) -> Outcome:
    """The same outcome made of what JSON gives back, so that a fresh record equals one that was read.

    Raises
    ------
    TypeError, ValueError : something in it is no JSON value (an array, a NaN)
    """
    o = outcome
    values = json.loads(_json([str(o.status), o.reason, o.outputs, o.result, o.sizes, o.sums]))
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
_CHECK = b', "check": "%s"}'
_SEALED = re.compile(rb', "check": "([0-9a-f]{16})"}\Z')
_KINDS: dict[str, type | UnionType] = {
    "stage": str, "unit": str, "attempt": int, "digest": str, "reason": str, "outputs": dict, "result": dict,
    "parameters": dict, "inputs": dict, "sizes": dict, "sums": dict, "traceback": str, "seconds": int | float, "peak_mb": int | float,
}  # fmt: skip
_REQUIRED = tuple(
    field.name for field in fields(Record) if field.default is MISSING and field.default_factory is MISSING
)
