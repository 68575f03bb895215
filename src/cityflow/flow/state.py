"""What has to be done about a task."""

from __future__ import annotations

from enum import StrEnum


class State(StrEnum):
    """What the ledger knows of a task (ARCHITECTURE.md, section 3)."""

    DONE = "done"
    """The newest attempt has a record with the task's digest (whatever its status), and its outputs are there."""
    STALE = "stale"
    """The newest record is of other inputs, parameters or another version."""
    MISSING = "missing"
    """There is no record."""
    SPOILED = "spoiled"
    """An attempt that writes in place started after the newest record and left none, or the newest record is damaged."""
    LOST = "lost"
    """The record is right, but an output is gone or is not what was written."""
