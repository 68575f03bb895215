"""A record on its way from a worker to the driver: its text, compressed once, as the index keeps it and segments take it over."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from functools import cached_property

from cityflow.flow.records import encode, parsed
from cityflow.flow.task import Record

LEVEL = 1
"""A third of the bytes in a tenth of a millisecond; a segment compresses anew, many records together."""


@dataclass(frozen=True)
class Sealed:
    """What a worker hands over, to the driver and to the tasks of drafts: a third of the record's size, and nothing to be written again.

    Attributes
    ----------
    body : the text of the record as its file has it, compressed
    """

    body: bytes

    @classmethod
    def of(cls, record: Record) -> Sealed:
        return cls(zlib.compress(encode(record), LEVEL))

    @classmethod
    def of_text(cls, text: bytes, record: Record) -> Sealed:
        """Of a record that was read; one of an older version in more than one line is written anew, since segments have one a line."""
        return cls(zlib.compress(text, LEVEL)) if b"\n" not in text else cls.of(record)

    @cached_property
    def text(self) -> bytes:
        return zlib.decompress(self.body)

    @cached_property
    def record(self) -> Record:
        return parsed(self.text)
