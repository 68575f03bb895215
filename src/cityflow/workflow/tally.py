"""What the newest records of a stage come to, counted row by row."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from math import fsum

from cityflow.core.building import Status
from cityflow.core.verdicts import Verdict
from cityflow.flow.ledger import Ledger
from cityflow.flow.row import Row


@dataclass
class Tally:
    """What the newest records of a stage come to.

    Attributes
    ----------
    reasons : status → reason → units
    verdicts : of the units that were asked for;  beyond : how many others there are
    """

    records: int = 0
    status: Counter[Status] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    peak_mb: float = 0.0
    reasons: dict[Status, dict[str, list[str]]] = field(default_factory=lambda: defaultdict(lambda: defaultdict(list)))
    verdicts: Counter[str] = field(default_factory=Counter)
    beyond: int = 0

    def add(self, row: Row) -> None:
        self.records += 1
        self.status[row.status] += 1
        if row.status in (Status.DONE, Status.DEGRADED):
            self.seconds.append(row.seconds)
            self.peak_mb = max(self.peak_mb, row.peak_mb)
        if row.status is not Status.DONE:
            self.reasons[row.status][row.reason or "no reason given"].append(row.unit)

    @property
    def mean_seconds(self) -> float:
        """Of the units that gave a result; 0 where none did. The same in whatever order they were counted."""
        return fsum(self.seconds) / len(self.seconds) if self.seconds else 0.0


def tally_of(ledger: Ledger, stage: str, units: Iterable[str], beyond: AbstractSet[str]) -> Tally:
    """Count these units of a stage; `beyond`: those outside the area of interest."""
    wanted, tally = frozenset(units), Tally()
    for row in ledger.rows(stage):
        if row.unit in wanted:
            tally.add(row)
            if row.unit in beyond:
                tally.beyond += 1
            elif verdict := verdict_of(row.status, row.verdict):
                tally.verdicts[verdict] += 1
    return tally


def verdict_of(status: Status, verdict: object) -> str:
    """What is to be expected of a model: good, look or poor, which all failed ones are; empty if not judged."""
    if status is Status.REFUSED:
        return ""
    return str(Verdict.POOR) if status is Status.FAILED else str(verdict or "")
