"""Current records of a RUN: earlier ones may belong to other tiles or outlines."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from cityflow.flow.inputs import LeftBehind
from cityflow.flow.ledger import Ledger
from cityflow.flow.task import Record, Task
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.runs.prepare import Prepared


@dataclass(frozen=True, slots=True)
class CurrentRecords:
    """The newest record of every task of a run that has one."""

    by_stage: Mapping[str, list[Record]]

    def stages(self) -> list[str]:
        """Names of the stages that have records, in the order of the flow."""
        return list(self.by_stage)

    def of(self, stage: str) -> list[Record]:
        """Records of a stage, sorted by unit."""
        return self.by_stage.get(stage, [])

    def checking(self, run: Prepared) -> Prepared:
        """The run, for readers that name a file in ``work/`` that is not as its record says."""
        left = LeftBehind(r for stage in self.stages() for r in self.of(stage))
        return replace(run, store=run.store.expecting(left))


def current_records(wanted: Prepared, ledger: Ledger) -> CurrentRecords:
    """Follow the graph of the run as far as records lead."""
    return walked(wanted.source(), ledger)


def walked(
    source: CitySource, ledger: Ledger, visit: Callable[[Task, Record], None] = lambda _task, _record: None
) -> CurrentRecords:
    """The newest record of every task that the source comes to; `visit` is told of each."""
    found: dict[str, list[Record]] = defaultdict(list)
    queue = deque(source.initial())
    while queue:
        task = queue.popleft()
        record = ledger.latest(task.stage, task.unit)
        if record is not None:
            found[task.stage].append(record)
            visit(task, record)
            queue.extend(source.after(task, record))
    return CurrentRecords({stage: sorted(found[stage], key=lambda r: r.unit) for stage in in_flow_order(found)})
