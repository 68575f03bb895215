"""What the newest records of a stage come to: counts, times and memory, without reading them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import fsum

from cityflow.core.arrays import IntArray
from cityflow.core.unit_status import Status
from cityflow.flow.row import Row
from cityflow.flow.segment_rows import GOOD, Rows, column
from cityflow.flow.some_units import SomeUnits


@dataclass
class Tally:
    """Newest records of units of one stage.

    Attributes
    ----------
    kinds : how many have which status and verdict
    seconds, peak_mb : of the units that gave a result
    others : those that are not done
    first_begun, last_begun : when the first and the last of them began, seconds since 1970; 0 where there is none
    oldest : the unit that began first
    """

    kinds: Counter[tuple[Status, str]] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    peak_mb: float = 0.0
    others: list[Row] = field(default_factory=list)
    first_begun: float = 0.0
    last_begun: float = 0.0
    oldest: str = ""

    @classmethod
    def of(cls, rows: Iterable[Row]) -> Tally:
        """Of rows, each the newest of its unit."""
        tally = cls()
        for row in rows:
            _add(tally, row)
        return tally

    @property
    def records(self) -> int:
        return sum(self.kinds.values())

    @property
    def status(self) -> dict[Status, int]:
        """How many units have which status; every status is a key."""
        return {s: sum(n for (status, _), n in self.kinds.items() if status is s) for s in Status}

    @property
    def every_seconds(self) -> list[float]:
        """Of all units, in no order."""
        return [*self.seconds, *(row.seconds for row in self.others if row.status not in GOOD)]

    @property
    def highest_mb(self) -> float:
        """Memory of all units, those that gave no result among them."""
        return max([self.peak_mb, *(row.peak_mb for row in self.others)])

    @property
    def mean_seconds(self) -> float:
        """0 where no unit gave a result. The same in whatever order they stand."""
        return fsum(self.seconds) / len(self.seconds) if self.seconds else 0.0


def tally_of(loose: Sequence[Row], table: Rows, joined: IntArray, units: SomeUnits) -> Tally:
    """Count rows, and some of a table; of these units alone where they are given."""
    tally = Tally()
    chosen = table.among(joined, units)
    tally.kinds.update(table.kinds(chosen))
    tally.seconds.extend(table.figures("seconds", chosen).tolist())
    tally.peak_mb = float(table.figures("peak_mb", chosen).max(initial=0.0))
    tally.others.extend(table.told(table.not_done(chosen)))
    if len(chosen):
        begun = column(table.table, "started")[chosen]
        first = int(chosen[begun.argmin()])
        tally.first_begun, tally.last_begun = float(begun.min()), float(begun.max())
        tally.oldest = table.table["unit"][first].as_py()
    for row in loose:
        if row.unit in units:
            _add(tally, row)
    return tally


def _add(tally: Tally, row: Row) -> None:
    if row.started < tally.first_begun or not tally.records:
        tally.first_begun, tally.oldest = row.started, row.unit
    tally.last_begun = max(tally.last_begun, row.started)
    tally.kinds[row.status, row.verdict] += 1
    if row.status in GOOD:
        tally.seconds.append(row.seconds)
        tally.peak_mb = max(tally.peak_mb, row.peak_mb)
    if row.status is not Status.DONE:
        tally.others.append(row)
