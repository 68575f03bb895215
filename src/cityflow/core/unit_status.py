"""How a unit ended, and what an attribute may hold: apart from buildings, so that an engine that only counts loads no arrays."""

from __future__ import annotations

from enum import StrEnum

Scalar = str | int | float | bool | None
"""What an attribute may hold; exactly JSON's scalars."""


class Status(StrEnum):
    """How a unit ended (ARCHITECTURE.md, section 3)."""

    DONE = "done"
    DEGRADED = "degraded"
    FAILED = "failed"
    REFUSED = "refused"
