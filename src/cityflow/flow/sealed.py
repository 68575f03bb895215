"""A record on its way from a worker to the driver: its text, compressed once, and beside it what the driver asks of it, so that nobody reads the text."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from operator import attrgetter
from typing import Any

from cityflow.flow.records import encode
from cityflow.flow.task import Record

LEVEL = 1
"""A third of the bytes in a tenth of a millisecond; a segment compresses anew, many records together."""

_LONG = ("parameters", "inputs")
"""Side by side, most of a record, and of no use to the driver: it has made them, or the worker that completed a draft has."""
_NAMES = tuple(field.name for field in fields(Record))
_HEAD = tuple(name for name in _NAMES if name not in _LONG)
_BEFORE = _NAMES.index(_LONG[0])
_head_of = attrgetter(*_HEAD)
_record_of: Callable[..., Record] = Record


@dataclass(frozen=True)
class Sealed:
    """What a worker hands over, to the driver and to the tasks of drafts.

    Attributes
    ----------
    body : the text of the record as its file has it, compressed
    head : the values of its fields, less its parameters and inputs
    """

    body: bytes
    head: tuple[Any, ...]

    @classmethod
    def of(cls, record: Record) -> Sealed:
        return cls(zlib.compress(encode(record), LEVEL), _head_of(record))

    @classmethod
    def of_text(cls, text: bytes, record: Record) -> Sealed:
        """Of a record that was read; one of an older version in more than one line is written anew, since segments have one a line."""
        return cls(zlib.compress(text, LEVEL), _head_of(record)) if b"\n" not in text else cls.of(record)

    @property
    def text(self) -> bytes:
        return zlib.decompress(self.body)

    @cached_property
    def record(self) -> Record:
        """The record without parameters and inputs."""
        return _record_of(*self.head[:_BEFORE], {}, {}, *self.head[_BEFORE:])
