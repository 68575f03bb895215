"""Which of the records in a RUN's folder belong to what was last asked for: tiles may have been cut otherwise before, outlines left out."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Record
from cityflow.stages.city import CitySource
from cityflow.workflow.prepare import Prepared


@dataclass(frozen=True, slots=True)
class CurrentRecords:
    """The newest record of every task of a run that has one."""

    by_stage: Mapping[str, list[Record]]

    def stages(self) -> list[str]:
        """Names of the stages that have records, sorted."""
        return list(self.by_stage)

    def of(self, stage: str) -> list[Record]:
        """Records of a stage, sorted by unit."""
        return self.by_stage.get(stage, [])


@dataclass(frozen=True, slots=True)
class StageFigures:
    """How a stage stands: units by status; mean seconds and highest megabytes of those that gave a result."""

    count: Mapping[Status, int]
    mean_seconds: float
    peak_mb: float

    @classmethod
    def of(cls, records: list[Record]) -> StageFigures:
        count = {status: sum(r.status is status for r in records) for status in Status}
        good = [r for r in records if r.status in (Status.DONE, Status.DEGRADED)]
        seconds = float(np.mean([r.seconds for r in good])) if good else 0.0
        return cls(count, seconds, max((r.peak_mb for r in good), default=0.0))


def current_records(wanted: Prepared, ledger: Ledger) -> CurrentRecords:
    """Follow the graph of the run as far as records lead."""
    return walked(wanted.source(), ledger)


def walked(source: CitySource, ledger: Ledger) -> CurrentRecords:
    found: dict[str, list[Record]] = defaultdict(list)
    queue = deque(source.initial())
    while queue:
        task = queue.popleft()
        record = ledger.latest(task.stage, task.unit)
        if record is not None:
            found[task.stage].append(record)
            queue.extend(source.after(task, record))
    return CurrentRecords({stage: sorted(found[stage], key=lambda r: r.unit) for stage in sorted(found)})
