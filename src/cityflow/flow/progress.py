"""Progress of a run: bars on a terminal, lines elsewhere, a line for every task, or nothing."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Mapping
from typing import NamedTuple, Protocol, TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from cityflow.core.unit_status import Status
from cityflow.flow.progress_counts import Counts, Expected
from cityflow.flow.talk import Talk
from cityflow.flow.task import Record, Task


class Watcher(Protocol):
    """Callbacks of `run_tasks`, all from the driver's thread."""

    counts: Counts

    def expect(self, expected: Mapping[str, Expected], workers: int) -> None:
        """What the run will take as far as one can know it now, by stage in the order of the flow; said again whenever more is known."""

    def ready(self, task: Task) -> None:
        """A task became ready: it counts towards its stage's total."""

    def finished(self, record: Record, *, fresh: bool) -> None:
        """A task ended; `fresh` is False for one that an earlier run had done."""

    def message(self, text: str) -> None:
        """Something that the user should read."""

    def tick(self) -> None:
        """Called a few times a second, whether something happened or not."""

    def close(self) -> None:
        """The run is over."""


class Silent:
    """Shows nothing, and counts."""

    def __init__(self) -> None:
        self.counts = Counts()

    def expect(self, expected: Mapping[str, Expected], workers: int) -> None:
        self.counts.expect(expected, workers)

    def ready(self, task: Task) -> None:
        self.counts.ready[task.stage] += 1

    def finished(self, record: Record, *, fresh: bool) -> None:
        self.counts.add(record, fresh=fresh)

    def message(self, text: str) -> None: ...

    def tick(self) -> None: ...

    def close(self) -> None: ...


class Lines(Silent):
    """Plain text, a line per stage that changed and one of all stages, at most every few seconds: for log files and pipes."""

    def __init__(self, stream: TextIO | None = None, every_s: float = 5.0) -> None:
        super().__init__()
        self._stream = stream or sys.stderr
        self._every_s = every_s
        self._changed: set[str] = set()
        self._last = time.monotonic()

    def finished(self, record: Record, *, fresh: bool) -> None:
        super().finished(record, fresh=fresh)
        self._changed.add(record.stage)

    def message(self, text: str) -> None:
        print(text, file=self._stream, flush=True)

    def tick(self) -> None:
        if time.monotonic() - self._last > self._every_s:
            self._show()

    def close(self) -> None:
        self._show()

    def _show(self) -> None:
        self._last = time.monotonic()
        for stage in self.counts.stages():
            if stage in self._changed:
                of = f"{self.counts.finished[stage]}/{self.counts.total_text(stage)}"
                self.message(f"{stage:<12} {of:>11}  {self.counts.words(stage)}")
        if self._changed and (overall := self.counts.overall()):
            self.message(f"{'all':<12} {overall}")
        self._changed.clear()


class EveryTask(Lines):
    """`Lines`, and a line for every task that ended, with its time and its reason."""

    def finished(self, record: Record, *, fresh: bool) -> None:
        super().finished(record, fresh=fresh)
        if fresh:
            reason = f": {record.reason}" if record.reason else ""
            name = f"{record.stage}-{record.unit}"
            self.message(f"  {name} {record.status}, {record.seconds:.2f} s, {record.peak_mb:.0f} MB{reason}")


_ENDED = re.compile(rf"  (\w+)-(.+) ({'|'.join(Status)}), \d+\.\d\d s, \d+ MB(: .*)?")


class Ended(NamedTuple):
    """A task that has ended, as far as its line tells."""

    stage: str
    unit: str
    status: Status


def ended_task(line: str) -> Ended | None:
    """What a line of `EveryTask` says of a task; None where it says something else.

    >>> ended_task("  reconstruct-flat red done, 1.25 s, 310 MB")
    Ended(stage='reconstruct', unit='flat red', status=<Status.DONE: 'done'>)
    >>> ended_task("reconstruct          1/3  1 done") is None
    True
    """
    found = _ENDED.fullmatch(line.rstrip("\n"))
    return None if found is None else Ended(found[1], found[2], Status(found[3]))


class Bars(Silent):
    """A bar per stage on a terminal, with its counts by status, failures in red; above them what all stages come to."""

    def __init__(self, console: Console | None = None) -> None:
        super().__init__()
        self._bars: dict[str, TaskID] = {}
        self._changed: set[str] = set()
        columns = [
            SpinnerColumn(),
            TextColumn("{task.description:<12}"),
            BarColumn(),
            TextColumn("{task.fields[of]}"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[words]}"),
        ]
        self._progress = Progress(*columns, console=console or Console(stderr=True), refresh_per_second=5)
        self._progress.start()

    def expect(self, expected: Mapping[str, Expected], workers: int) -> None:
        super().expect(expected, workers)
        self._changed.update(expected)

    def ready(self, task: Task) -> None:
        super().ready(task)
        self._changed.add(task.stage)

    def finished(self, record: Record, *, fresh: bool) -> None:
        super().finished(record, fresh=fresh)
        self._changed.add(record.stage)

    def message(self, text: str) -> None:
        self._progress.console.print(Text(text))

    def tick(self) -> None:
        if not self._changed:
            return
        if overall := self.counts.overall():
            self._show("all", self.counts.share(), 1.0, "", overall)
        for stage in self.counts.stages():
            if stage in self._changed or stage not in self._bars:
                done, total = self.counts.finished[stage], self.counts.total(stage)
                self._show(stage, done, max(total, 1), f"{done}/{self.counts.total_text(stage)}", self._coloured(stage))
        self._changed.clear()

    def close(self) -> None:
        self.tick()
        self._progress.stop()

    def _show(self, name: str, done: float, total: float, of: str, words: str) -> None:
        if name not in self._bars:
            self._bars[name] = self._progress.add_task(name, total=total, words="", of="")
        self._progress.update(self._bars[name], completed=done, total=total, of=of, words=words)

    def _coloured(self, stage: str) -> str:
        bad = self.counts.of(stage, Status.FAILED)
        return f"[red]{self.counts.words(stage)}[/red]" if bad else self.counts.words(stage)


def watcher(stream: TextIO | None = None, talk: Talk = Talk.NORMAL) -> Watcher:
    """Bars where the stream (stderr if None) is a terminal, else lines; a line for every task, or nothing, if that is asked for."""
    stream = stream or sys.stderr
    if talk is Talk.QUIET:
        return Silent()
    if talk is Talk.VERBOSE:
        return EveryTask(stream)
    return Bars(Console(file=stream)) if stream.isatty() else Lines(stream)
