"""What the driver tells whoever watches, and two ways to show it: bars on a terminal, lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections import Counter
from typing import Protocol, TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn
from rich.text import Text

from cityflow.core.building import Status
from cityflow.flow.task import Record, Task


class Watcher(Protocol):
    """Callbacks of `run_tasks`, all from the driver's thread."""

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
    """Shows nothing."""

    def ready(self, task: Task) -> None: ...

    def finished(self, record: Record, *, fresh: bool) -> None: ...

    def message(self, text: str) -> None: ...

    def tick(self) -> None: ...

    def close(self) -> None: ...


class Counts:
    """Per stage: how many units are ready, finished, and with which status."""

    def __init__(self) -> None:
        self.ready: Counter[str] = Counter()
        self.finished: Counter[str] = Counter()
        self.kept: Counter[str] = Counter()
        self.by_status: dict[str, Counter[Status]] = {}

    def add(self, record: Record, *, fresh: bool) -> None:
        self.finished[record.stage] += 1
        self.kept[record.stage] += not fresh
        self.by_status.setdefault(record.stage, Counter())[record.status] += 1

    def words(self, stage: str) -> str:
        """``12 done, 1 failed (3 from before)``."""
        counts = self.by_status.get(stage, Counter())
        text = ", ".join(f"{counts[status]} {status}" for status in Status if counts[status])
        return text + (f" ({self.kept[stage]} from before)" if self.kept[stage] else "")


class Lines:
    """Plain text, a line per stage that changed, at most every few seconds: for log files and pipes."""

    def __init__(self, stream: TextIO | None = None, every_s: float = 5.0) -> None:
        self._stream = stream or sys.stderr
        self._every_s = every_s
        self._counts = Counts()
        self._changed: set[str] = set()
        self._last = time.monotonic()

    def ready(self, task: Task) -> None:
        self._counts.ready[task.stage] += 1

    def finished(self, record: Record, *, fresh: bool) -> None:
        self._counts.add(record, fresh=fresh)
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
        for stage in sorted(self._changed):
            of = f"{self._counts.finished[stage]}/{self._counts.ready[stage]}"
            self.message(f"{stage:<12} {of:>11}  {self._counts.words(stage)}")
        self._changed.clear()


class Bars:
    """A bar per stage on a terminal, with its counts by status; failures in the colour of failures."""

    def __init__(self, console: Console | None = None) -> None:
        self._counts = Counts()
        self._bars: dict[str, TaskID] = {}
        self._changed: set[str] = set()
        columns = [
            SpinnerColumn(),
            TextColumn("{task.description:<12}"),
            BarColumn(),
            TextColumn("{task.completed:.0f}/{task.total:.0f}"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[words]}"),
        ]
        self._progress = Progress(*columns, console=console or Console(stderr=True), refresh_per_second=5)
        self._progress.start()

    def ready(self, task: Task) -> None:
        self._counts.ready[task.stage] += 1
        self._changed.add(task.stage)

    def finished(self, record: Record, *, fresh: bool) -> None:
        self._counts.add(record, fresh=fresh)
        self._changed.add(record.stage)

    def message(self, text: str) -> None:
        self._progress.console.print(Text(text))

    def tick(self) -> None:
        for stage in sorted(self._changed):
            if stage not in self._bars:
                self._bars[stage] = self._progress.add_task(stage, total=1, words="")
            self._progress.update(
                self._bars[stage],
                completed=self._counts.finished[stage],
                total=self._counts.ready[stage],
                words=self._coloured(stage),
            )
        self._changed.clear()

    def close(self) -> None:
        self.tick()
        self._progress.stop()

    def _coloured(self, stage: str) -> str:
        counts = self._counts.by_status.get(stage, Counter())
        bad = counts[Status.FAILED]
        return f"[red]{self._counts.words(stage)}[/red]" if bad else self._counts.words(stage)


def watcher(stream: TextIO | None = None) -> Watcher:
    """Bars where the stream (stderr if None) is a terminal, else lines."""
    stream = stream or sys.stderr
    return Bars(Console(file=stream)) if stream.isatty() else Lines(stream)
