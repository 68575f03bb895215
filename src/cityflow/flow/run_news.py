"""What a driver tells of its run while it works: counts, newest failures, and the state of each place. For the dashboard's page and for `status --watch`."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol
from uuid import uuid4

from cityflow.core.credentials import without_credentials
from cityflow.core.unit_status import Status
from cityflow.flow.progress import Watcher
from cityflow.flow.progress_counts import Expected
from cityflow.flow.row import first_line
from cityflow.flow.task import Record, Task

MOST_FAILURES = 100
"""Failures that are told, the newest."""
LONGEST_REASON = 300


class Places(Protocol):
    """The map of a run: places that hold many units each, such as ground tiles. Called in the driver only."""

    def all(self) -> Iterable[str]:
        """Names of the places that are asked for; ``column_row`` for a page that draws them."""

    def of(self, stage: str, unit: str) -> str:
        """The place of a unit; empty where it has none."""

    def is_closed_by(self, record: Record) -> bool:
        """Whether nothing of its place is left to do after this."""


class Nowhere:
    """A run without a map."""

    def all(self) -> Iterable[str]:
        return ()

    def of(self, stage: str, unit: str) -> str:  # noqa: ARG002 - the signature of `Places`
        return ""

    def is_closed_by(self, record: Record) -> bool:  # noqa: ARG002 - the signature of `Places`
        return False


@dataclass(slots=True)
class Place:
    """Units of one place; `is_asked` False for one that only its neighbours need."""

    ready: int = 0
    finished: int = 0
    failed: int = 0
    is_closed: bool = False
    is_asked: bool = False

    def as_json(self) -> list[int]:
        return [self.ready, self.finished, self.failed, int(self.is_closed), int(self.is_asked)]


Tell = Callable[["RunNews"], None]


@dataclass(slots=True)
class _Teller:
    tell: Tell
    every_s: float
    next: float = 0.0


@dataclass
class RunNews:
    """A watcher around another one: what it hears goes on to that, and now and then to whom it tells.

    Attributes
    ----------
    inner : shows progress on the terminal
    places : the map
    is_at_work : False after the end
    driver : tells this pass of a driver from every other one
    """

    inner: Watcher
    places: Places = field(default_factory=Nowhere)
    is_at_work: bool = True
    driver: str = field(default_factory=lambda: uuid4().hex)
    _tellers: list[_Teller] = field(default_factory=list)
    _found: dict[str, Place] = field(default_factory=dict)
    _changed: set[str] = field(default_factory=set)
    _failures: dict[tuple[str, str], str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.counts = self.inner.counts

    def tell_to(self, tell: Tell, every_s: float) -> None:
        """Call a function about so often, and at the end; more seldom where it takes more than a fiftieth of the time."""
        self._tellers.append(_Teller(tell, every_s))

    def summary(self) -> dict[str, Any]:
        """Counts by stage, share of the work, text of all stages, newest failures; small whatever the size of the city."""
        failures = [[stage, unit, reason] for (stage, unit), reason in self._failures.items()]
        return {**self.counts.as_json(), "driver": self.driver, "is_at_work": self.is_at_work, "failures": failures}

    def changed_places(self) -> dict[str, list[int]]:
        """Places that changed since this was asked last: ready, finished, failed units; whether it is closed, and asked for."""
        for name in self.places.all() if not self._found else ():
            self._found[name] = Place(is_asked=True)
            self._changed.add(name)
        changed, self._changed = self._changed, set()
        return {name: self._found[name].as_json() for name in sorted(changed)}

    def expect(self, expected: Mapping[str, Expected], workers: int) -> None:
        self.inner.expect(expected, workers)

    def ready(self, task: Task) -> None:
        self.inner.ready(task)
        if name := self.places.of(task.stage, task.unit):
            self._place(name).ready += 1

    def finished(self, record: Record, *, fresh: bool) -> None:
        self.inner.finished(record, fresh=fresh)
        failed = record.status is Status.FAILED
        if failed:
            self._failed(record)
        if name := self.places.of(record.stage, record.unit):
            place = self._place(name)
            place.finished += 1
            place.failed += failed
            place.is_closed = place.is_closed or self.places.is_closed_by(record)

    def message(self, text: str) -> None:
        self.inner.message(text)

    def tick(self) -> None:
        self.inner.tick()
        now = time.monotonic()
        for teller in self._tellers:
            if now >= teller.next:
                teller.tell(self)
                spent = time.monotonic() - now
                teller.next = now + spent + max(teller.every_s, 50 * spent)

    def close(self) -> None:
        self.is_at_work = False
        for teller in self._tellers:
            teller.tell(self)
        self.inner.close()

    def _place(self, name: str) -> Place:
        if not self._found:
            self.changed_places()
            self._changed.update(self._found)
        self._changed.add(name)
        return self._found.setdefault(name, Place())

    def _failed(self, record: Record) -> None:
        node = record.stage, record.unit
        self._failures.pop(node, None)
        self._failures[node] = without_credentials(first_line(record.reason))[:LONGEST_REASON]
        if len(self._failures) > MOST_FAILURES:
            del self._failures[next(iter(self._failures))]
