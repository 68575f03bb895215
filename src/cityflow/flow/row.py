"""What a ledger knows of a record without reading it."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any, NamedTuple

from cityflow.core.unit_status import Status
from cityflow.core.verdicts import VERDICT_KEY
from cityflow.flow.task import Record


class Row(NamedTuple):
    """One record in short.

    Attributes
    ----------
    reason : its first line
    verdict : of a unit that was judged, else empty
    started : seconds since 1970, 0 if unknown; of two records with the same number, the later one counts
    """

    stage: str
    unit: str
    attempt: int
    status: Status
    reason: str
    verdict: str
    seconds: float
    peak_mb: float
    started: float

    def as_values(self) -> tuple[Any, ...]:
        """In the order of `NAMES`, as tables take them."""
        return (
            self.stage, self.unit, self.attempt, str(self.status), self.reason, self.verdict, self.seconds, self.peak_mb, self.started,
        )  # fmt: skip

    @classmethod
    def of_values(cls, values: Sequence[Any]) -> Row:
        """Inverse of `as_values`."""
        stage, unit, attempt, status, *more = values
        return cls(stage, unit, attempt, Status(status), *more)


class Line(NamedTuple):
    """A record to be joined: what is known of it, the digest of its task, and its text."""

    row: Row
    digest: str
    text: bytes


NAMES = Row._fields


def row_of(record: Record) -> Row:
    return Row(
        record.stage, record.unit, record.attempt, record.status, first_line(record.reason), str(record.result.get(VERDICT_KEY) or ""),
        float(record.seconds), float(record.peak_mb), _seconds(record.started),
    )  # fmt: skip


def first_line(reason: str) -> str:
    return reason.splitlines()[0] if reason else ""


def _seconds(started: str) -> float:
    try:
        return datetime.fromisoformat(started).timestamp()
    except ValueError:
        return 0.0
