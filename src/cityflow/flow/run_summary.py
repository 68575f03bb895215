"""Summary of a run of tasks."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from cityflow.core.unit_status import Status


@dataclass(frozen=True, slots=True)
class Summary:
    """What a run did.

    Attributes
    ----------
    ran : (stage, status) → units that ran
    kept : (stage, status) → units that an earlier run had done
    seconds : wall-clock time
    interrupted : stopped by Ctrl-C
    damaged : files that were not what tasks had written; what made them, and what reads them, has still to run
    """

    ran: Counter[tuple[str, Status]] = field(default_factory=Counter)
    kept: Counter[tuple[str, Status]] = field(default_factory=Counter)
    seconds: float = 0.0
    interrupted: bool = False
    damaged: frozenset[str] = frozenset()
