"""The ledger: what the records of a RUN say, be they files of their own or joined in segments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain

from cityflow.core.arrays import IntArray
from cityflow.core.unit_status import Status
from cityflow.flow.fresh import Taken
from cityflow.flow.loose import Held, Loose
from cityflow.flow.mending import mended
from cityflow.flow.outputs import Outputs
from cityflow.flow.record_segments import Piece, Segment, bits_of, write_segment
from cityflow.flow.records import quoted, write_mark
from cityflow.flow.removal import Removal
from cityflow.flow.row import Row
from cityflow.flow.sealed import Sealed
from cityflow.flow.segment_index import Joined
from cityflow.flow.segment_rows import Place, Rows
from cityflow.flow.some_units import ALL, SomeUnits
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.tally import Tally, tally_of
from cityflow.flow.task import Record, Task

SEGMENT = 4096
"""Records that are joined in one segment: some megabytes, so that a million buildings have about a thousand."""


class Ledger:
    """Records of one RUN; made by `Ledger.open`. Belongs to the thread that opened it.

    Of two records with the same number, which two drivers at once may leave on an object store, the one that started later counts.
    """

    def __init__(self, store: Store, *, verify: bool = False, segment: int = SEGMENT) -> None:
        self.store = store
        self._segment = segment
        self.verify = verify
        self._outputs = Outputs(store, verify=verify)
        self._loose = Loose(store)
        self._joined = Joined(store, verify=verify)
        self.removal = Removal(store)  # of files of joined records: true while some are still to go
        self._waiting = 0
        self._last: Record | None = None

    @classmethod
    def open(cls, store: Store, *, verify: bool = False, segment: int = SEGMENT) -> Ledger:
        """Open the index and bring it up to date with the records; makes a new one where it is missing or damaged.

        Parameters
        ----------
        verify : also hold the contents of outputs and segments against their digests, not their sizes alone
        segment : records that `join` joins in one

        Raises
        ------
        RunError : there is no place for an index
        """
        ledger = cls(store, verify=verify, segment=segment)
        ledger._loose.open()
        ledger._joined.refresh()  # after the files: what a driver joins meanwhile is in one of them
        ledger._waiting = ledger._loose.count()
        return ledger

    def __enter__(self) -> Ledger:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self.removal.close()
        self._loose.close()

    def refresh(self) -> int:
        """Take over records and marks that others wrote, forget those that are gone or changed; returns how many files of them were new."""
        self._last = None
        self.removal.settle()
        new = self._loose.refresh()
        self._joined.refresh()
        self._waiting = self._loose.count()
        return new

    def add(self, record: Record, sealed: Sealed | None = None) -> None:
        """Index a record that a task has just written; `sealed`: the same, as its worker has handed it over."""
        self._last = None
        self._loose.add(record, sealed or Sealed.of(record))
        self._outputs.add(record)
        self._waiting += 1

    def commit(self) -> None:
        """Let others see what was indexed, and see what they have done; a killed driver loses nothing, since the records are files."""
        self._loose.commit()

    @contextmanager
    def driven(self) -> Iterator[None]:
        """While the block lasts, this process alone runs tasks: what it adds stays in memory until it is joined, or the block ends."""
        self._loose.is_driver = True
        try:
            yield
        finally:
            self._loose.is_driver = False
            self._loose.settle()
            # else others wait for the index as long as this process makes its report
            self._loose.commit()

    def spoil(self, stage: str, unit: str) -> None:
        """Say that what a task has left is not to be trusted: it is made again."""
        attempt = self.next_attempt(stage, unit)
        write_mark(self.store, stage, unit, attempt)
        self._loose.add_mark(stage, unit, attempt)

    def problems(self) -> list[str]:
        """What is wrong with segments, a line for each."""
        return sorted(self._joined.problems.values())

    def latest(self, stage: str, unit: str) -> Record | None:
        """The record with the highest attempt, or None."""
        last = self._last
        if last is not None and last.unit == unit and last.stage == stage:
            return last
        self._last = next(self._newest_first(quoted(stage), quoted(unit)), None)
        return self._last

    def standing(self, stage: str, unit: str) -> Record | None:
        """The newest record, unless a later attempt has begun: what a task is held against."""
        record = self.latest(stage, unit)
        return record if record is not None and record.attempt + 1 == self.next_attempt(stage, unit) else None

    def has(self, stage: str, unit: str) -> bool:
        """Whether a unit has a record; none is read."""
        key = quoted(stage), quoted(unit)
        if self._loose.has(*key):
            return True
        self._catch_up()
        return self._joined.knows(*key)

    def attempts(self, stage: str, unit: str) -> list[Record]:
        """All records of a unit, oldest first."""
        return list({r.attempt: r for r in reversed([*self._newest_first(quoted(stage), quoted(unit))])}.values())

    def last_good(self, stage: str, unit: str) -> Record | None:
        """The newest record that left something, where the newest of all may have failed."""
        every = self._newest_first(quoted(stage), quoted(unit))
        return next((r for r in every if r.status in (Status.DONE, Status.DEGRADED)), None)

    def records(self, stage: str | None = None) -> Iterator[Record]:
        """The newest record of every unit, of one stage or of all, sorted by stage and unit; each is read when its turn comes."""
        names = sorted((row.stage, row.unit) for row in self.rows(stage))
        return (record for name in names if (record := self.latest(*name)) is not None)

    def as_stored(self, stage: str, units: SomeUnits = ALL) -> Iterator[Record]:
        """The newest records of a stage, or of some of its units, in the order in which they lie in segments: what lies together is unpacked once."""
        loose, table, joined = self._newest(stage)
        found: Iterator[tuple[str, Record | None]] = ((row.unit, None) for row in loose if row.unit in units)
        if len(joined := table.among(joined, units)):
            found = chain(found, self._joined.as_stored(joined))
        return (record for unit, here in found if (record := here or self.latest(stage, unit)) is not None)

    def pieces(self, tasks: Mapping[str, SomeUnits]) -> tuple[list[Row], list[Piece]]:
        """The newest records of units by stage: those in files of their own in short, and where the others stand, segment by segment."""
        found = [(units, *self._newest(stage)) for stage, units in tasks.items()]
        loose = [row for units, rows, _, _ in found for row in rows if row.unit in units]
        return loose, self._joined.pieces([table.among(joined, units) for units, _, table, joined in found])

    def rows(self, stage: str | None = None) -> Iterator[Row]:
        """The newest record of every unit in short, in no order."""
        loose, table, joined = self._newest(stage)
        yield from loose
        yield from table.told(joined)

    def units(self, stage: str, status: Status | None = None) -> list[str]:
        """Names of the units that have a record, sorted; those whose newest record has `status` where given."""
        if status is not None:
            return sorted(row.unit for row in self.rows(stage) if row.status is status)
        loose, table, joined = self._newest(stage)
        return sorted([*(row.unit for row in loose), *table.names(joined)])

    def stages(self) -> list[str]:
        """Names of the stages that have records, sorted."""
        return sorted({row.stage for row in self._loose.newest()} | self._joined.stages())

    def tally(self, stage: str, units: Iterable[str] | SomeUnits = ALL) -> Tally:
        """What the newest records of a stage come to, or those of some of its units; none of them is read."""
        return tally_of(*self._newest(stage), units if isinstance(units, SomeUnits) else SomeUnits.only(units))

    def count_files(self) -> int:
        """How many attempts left a record, or a mark and nothing since."""
        loose = sum(not self._joined.has(*number) for number in self._loose.numbers())
        self._catch_up()
        marks = sum(all(p.attempt < at for p in self._joined.find(s, f)) for s, f, at in self._loose.open_marks())
        return loose + marks + len(self._joined)

    def next_attempt(self, stage: str, unit: str) -> int:
        """One more than the highest attempt that has a record or a mark."""
        key = quoted(stage), quoted(unit)
        found = self._found(*key)
        return max(self._mark(*key), found[0].attempt if found else 0) + 1

    def state(self, task: Task) -> State:
        return self.state_and_attempt(task)[0]

    def state_and_attempt(self, task: Task) -> tuple[State, int]:
        """What has to be done about a task, and its `next_attempt`."""
        key = quoted(task.stage), quoted(task.unit)
        found, mark = self._found(*key), self._mark(*key)
        newest = found[0].attempt if found else 0
        if mark > newest:
            return State.SPOILED, mark + 1
        if not found:
            return State.MISSING, 1
        state = self._held_against(found[0], key, task.digest)
        # a record that turns out to be damaged counts as an attempt that left none
        return state, self.next_attempt(task.stage, task.unit) if state is State.SPOILED else newest + 1

    def _held_against(self, newest: Held | Place, key: tuple[str, str], digest: str) -> State:
        """A task with this digest against the newest record of its unit."""
        if isinstance(newest, Place) and newest.digest != bits_of(digest):
            return State.STALE
        self._last = record = self._read(newest, *key)
        if record is None:
            return State.SPOILED
        if record.digest != digest:
            return State.STALE
        return State.DONE if self._outputs.all_there(record) else State.LOST

    def join(self) -> int:
        """Join the oldest records that lie in files of their own, if they fill a segment; returns how many.

        Their files go in the background when the segment was read back. For drivers only. A driver that is killed loses nothing: until then
        the files are there, and what stands in both is one record. Raises OSError where the segment cannot be written, or files of an earlier one
        cannot be removed.
        """
        records, new = self.to_join()
        if records:
            self.joined(records, write_segment(self.store, [taken.line for taken in new]) if new else None)
        return len(records)

    def to_join(self) -> tuple[list[Taken], list[Taken]]:
        """What `join` would join now: the records, and those of them that stand in no segment yet. Raises OSError as `join`."""
        if self._waiting >= self._segment:
            self.removal.settle()
            records = self._loose.oldest(self._segment)
            self._waiting = len(records)
            if self._waiting >= self._segment:
                return records, [taken for taken in records if not self._joined.has_same(taken)]
        return [], []

    def joined(self, records: Sequence[Taken], segment: Segment | None) -> None:
        """What `to_join` gave stands in segments now, its new records in this one: it was read back."""
        if segment is not None:
            self._joined.add(segment)
        self.removal.begin(self._loose.moved(records, [] if segment is None else [segment.name]))
        self._waiting = self._loose.count()

    def mend(self) -> list[str]:
        """Take damaged segments apart, and write tables that are missing; returns what was found, a line for each. For drivers only."""
        if not self._joined.problems and not self._joined.unfinished:
            return []
        told, gone = mended(self.store, self._joined)
        self._loose.apart(gone)
        self._joined.forget()
        self.refresh()
        return told

    def _found(self, stage: str, folder: str) -> list[Held | Place]:
        """Records of a unit, newest first."""
        found: list[Held | Place] = [*self._loose.of(stage, folder)]
        self._catch_up()
        joined = self._joined.find(stage, folder)
        return sorted([*found, *joined], key=lambda f: (f.attempt, f.started), reverse=True) if joined else found

    def _read(self, found: Held | Place, stage: str, folder: str) -> Record | None:
        return found.record if isinstance(found, Held) else self._joined.read(found, stage, folder)

    def _newest_first(self, stage: str, folder: str) -> Iterator[Record]:
        for found in self._found(stage, folder):
            if (record := self._read(found, stage, folder)) is not None:
                yield record

    def _mark(self, stage: str, folder: str) -> int:
        """The highest attempt that began and left no record that can be read, or 0."""
        return max(self._loose.mark(stage, folder), self._joined.lost(stage, folder))

    def _catch_up(self) -> None:
        """Another driver may have joined what was in files: asked after these, so that nothing is missed."""
        known = self._loose.segments()
        if known is not None and not known <= self._joined.names:
            self._joined.refresh()

    def _newest(self, stage: str | None) -> tuple[list[Row], Rows, IntArray]:
        """Newest rows of units: those in files of their own, and which of a table of those in segments."""
        loose = self._loose.newest(stage)
        self._catch_up()
        rows, joined = self._joined.newest(stage)
        loose, joined = rows.overlaid(loose, joined)
        return loose, rows, joined
