"""Current records of a RUN: earlier ones may belong to other tiles or outlines."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import overload

from cityflow.flow.inputs import Inputs, LeftBehind
from cityflow.flow.ledger import Ledger
from cityflow.flow.row import Row, row_of
from cityflow.flow.some_units import SomeUnits
from cityflow.flow.tally import Tally
from cityflow.flow.task import Record, Task
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.runs.asked import Asked
from cityflow.runs.prepare import Prepared


@dataclass(frozen=True, slots=True)
class StoredRecords(Sequence[Record]):
    """The newest records of some units of a stage, each read from the ledger when its turn comes: only names are in memory.

    The ledger has to be open as long as these are in use.
    """

    ledger: Ledger
    stage: str
    units: Sequence[str]

    def __len__(self) -> int:
        return len(self.units)

    @overload
    def __getitem__(self, index: int) -> Record: ...
    @overload
    def __getitem__(self, index: slice) -> StoredRecords: ...
    def __getitem__(self, index: int | slice) -> Record | StoredRecords:
        if isinstance(index, slice):
            return replace(self, units=self.units[index])
        record = self.ledger.latest(self.stage, self.units[index])
        if record is None:
            raise IndexError(f"{self.stage}-{self.units[index]} has no record any more")
        return record

    def __iter__(self) -> Iterator[Record]:
        return (record for unit in self.units if (record := self.ledger.latest(self.stage, unit)) is not None)

    def as_stored(self) -> Iterator[Record]:
        """The same in the order in which they are stored, which is the quickest way to all of them."""
        return self.ledger.as_stored(self.stage, SomeUnits.of(self.units, self.ledger.units(self.stage)))

    def tally(self) -> Tally:
        """What they come to; no record is read."""
        every = self.ledger.tally(self.stage)
        return every if every.records == len(self.units) else self.ledger.tally(self.stage, self.units)

    def rows(self) -> Iterator[Row]:
        """In short, in no order; no record is read."""
        wanted = frozenset(self.units)
        return (row for row in self.ledger.rows(self.stage) if row.unit in wanted)


@dataclass(frozen=True, slots=True)
class CurrentRecords:
    """The newest record of every task of a run that has one."""

    by_stage: Mapping[str, Sequence[Record]]

    def stages(self) -> list[str]:
        """Names of the stages that have records, in the order of the flow."""
        return list(self.by_stage)

    def of(self, stage: str) -> Sequence[Record]:
        """Records of a stage, sorted by unit; read one by one."""
        return self.by_stage.get(stage, ())

    def as_stored(self, stage: str) -> Iterable[Record]:
        """Records of a stage in no order: where all are read, in a fraction of the time."""
        found = self.of(stage)
        return found.as_stored() if isinstance(found, StoredRecords) else found

    def units(self, stage: str) -> Sequence[str]:
        """Names of the units of a stage that have a record, sorted."""
        found = self.of(stage)
        return found.units if isinstance(found, StoredRecords) else [record.unit for record in found]

    def some(self, stage: str, units: Iterable[str]) -> Sequence[Record]:
        """Those of some units, sorted; read one by one."""
        found, wanted = self.of(stage), frozenset(units)
        if isinstance(found, StoredRecords):
            return replace(found, units=[unit for unit in sorted(wanted) if _holds(found.units, unit)])
        return [record for record in found if record.unit in wanted]

    def rows(self, stage: str) -> Iterator[Row]:
        """Records of a stage in short, in no order."""
        found = self.of(stage)
        return found.rows() if isinstance(found, StoredRecords) else map(row_of, found)

    def tally(self, stage: str) -> Tally:
        """What the records of a stage come to."""
        found = self.of(stage)
        return found.tally() if isinstance(found, StoredRecords) else Tally.of(map(row_of, found))

    def checking(self, run: Prepared) -> Prepared:
        """The run, for readers that name a file in ``work/`` that is not as its record says."""
        every = [self.of(stage) for stage in self.stages()]
        stored = next((found for found in every if isinstance(found, StoredRecords)), None)
        known = LeftBehind(r for found in every for r in found) if stored is None else Inputs(run.store, stored.ledger)
        return replace(run, store=run.store.expecting(known))


def _holds(names: Sequence[str], name: str) -> bool:
    """Whether sorted names hold one."""
    at = bisect_left(names, name)
    return at < len(names) and names[at] == name


def current_records(wanted: Prepared, ledger: Ledger) -> CurrentRecords:
    """Follow the graph of the run as far as records lead."""
    return walked(wanted.source(ledger), ledger)


def noted_records(asked: Asked, ledger: Ledger) -> CurrentRecords:
    """The records that a note names."""
    found = {s: units.among(ledger.units(s)) for s, units in asked.tasks.items()}
    return CurrentRecords({s: StoredRecords(ledger, s, units) for s, units in found.items() if units})


def known_records(wanted: Prepared, ledger: Ledger, asked: Asked | None) -> CurrentRecords:
    """What a note names, where it counts and nothing is out of date; else the graph is followed."""
    if asked is None or asked.is_at_work or asked.stale:
        return current_records(wanted, ledger)
    return noted_records(asked, ledger)


def walked(
    source: CitySource, ledger: Ledger, visit: Callable[[Task, Record], None] = lambda _task, _record: None
) -> CurrentRecords:
    """The newest record of every task that the source comes to; `visit` is told of each.

    What a record makes ready is followed before what stands beside it, so that few tasks wait at a time.
    """
    found: dict[str, list[str]] = defaultdict(list)
    ready: list[Iterator[Task]] = [iter(source.initial())]
    while ready:
        task = next(ready[-1], None)
        if task is None:
            ready.pop()
            continue
        record = ledger.latest(task.stage, task.unit)
        if record is not None:
            found[task.stage].append(task.unit)
            visit(task, record)
            ready.append(iter(source.after(task, record)))
    return stored_records(ledger, found)


def stored_records(ledger: Ledger, units: Mapping[str, Iterable[str]]) -> CurrentRecords:
    """The newest records of these units by stage, each named once."""
    return CurrentRecords({s: StoredRecords(ledger, s, sorted(set(units[s]))) for s in in_flow_order(units)})
