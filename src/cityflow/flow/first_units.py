"""Stops a run if the first units of a stage all raise the same exception."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cityflow.errors import RunError
from cityflow.flow.attempt import is_unexpected
from cityflow.flow.task import Record

FIRST_UNITS = 20


@dataclass(slots=True)
class _Streak:
    signature: str
    count: int


class FirstUnits:
    """Watches the first units of every stage."""

    def __init__(self, first_units: int = FIRST_UNITS) -> None:
        self._first_units = first_units
        self._streaks: dict[str, _Streak | None] = {}

    def add(self, record: Record) -> None:
        """Count a finished unit.

        Raises
        ------
        RunError : it is the last of the first units, and all of them raised the same exception
        """
        signature = signature_of(record) if is_unexpected(record) else None
        streak = self._streaks.setdefault(record.stage, _Streak(signature or "", 0))
        if streak is None:
            return
        if signature is None or signature != streak.signature:
            self._streaks[record.stage] = None
            return
        streak.count += 1
        if streak.count >= self._first_units:
            raise _stop(record, streak.count)


def signature_of(record: Record) -> str:
    """Type and message of the exception, without what differs from unit to unit (its name, numbers)."""
    return re.sub(r"[0-9a-f]*\d[0-9a-f]*", "#", record.reason.replace(record.unit, "#"))


def _stop(record: Record, count: int) -> RunError:
    place = next((line.strip() for line in reversed(record.traceback.splitlines()) if "File " in line), "")
    return RunError(
        f"the first {count} units of stage {record.stage} all failed in the same way: {record.reason}",
        where=place or record.stage,
        remedy="the cause is not in single units: fix it, then `cityflow rerun RUN --failed`",
    )
