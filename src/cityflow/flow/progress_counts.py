"""Counts of a run: units by stage and status against the expected number, share of the work done, time left."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from cityflow.core.unit_status import Status
from cityflow.flow.task import Record

LEAST_MEASURED = 5
"""Units of a stage after which its own mean time counts, and not the time that was expected of it."""


@dataclass(frozen=True, slots=True)
class Expected:
    """What is expected of a stage: tasks in all, seconds of one; whether the number is known or the least that there can be."""

    units: int
    seconds: float
    is_known: bool = True


class Counts:
    """Per stage: how many units are ready, finished, and with which status; over all stages, how much work is left."""

    def __init__(self) -> None:
        self.ready: Counter[str] = Counter()
        self.finished: Counter[str] = Counter()
        self.kept: Counter[str] = Counter()
        self.by_status: dict[str, Counter[Status]] = {}
        self._seconds: defaultdict[str, float] = defaultdict(float)
        self._expected: dict[str, Expected] = {}
        self._workers = 1
        self._begun = time.monotonic()

    def expect(self, expected: Mapping[str, Expected], workers: int) -> None:
        self._expected, self._workers = dict(expected), max(workers, 1)

    def add(self, record: Record, *, fresh: bool) -> None:
        self.finished[record.stage] += 1
        self.kept[record.stage] += not fresh
        self._seconds[record.stage] += record.seconds
        self.by_status.setdefault(record.stage, Counter())[record.status] += 1

    def stages(self) -> list[str]:
        """Stages that have tasks, in the order of what was expected, then of their first task."""
        return list(
            dict.fromkeys([*(s for s, e in self._expected.items() if self.total(s) or not e.is_known), *self.ready])
        )

    def of(self, stage: str, status: Status) -> int:
        return self.by_status.get(stage, Counter())[status]

    def total(self, stage: str) -> int:
        """Tasks of a stage: as many as are expected, or more where more became ready."""
        expected = self._expected.get(stage)
        return max(self.ready[stage], expected.units if expected else 0)

    def total_text(self, stage: str) -> str:
        """The total; ``12+`` or ``?`` where more may come."""
        expected, total = self._expected.get(stage), self.total(stage)
        if expected is None or expected.is_known:
            return str(total)
        return f"{total}+" if total else "?"

    def words(self, stage: str) -> str:
        """``12 done, 1 failed (3 from before)``."""
        counts = self.by_status.get(stage, Counter())
        text = ", ".join(f"{counts[status]} {status}" for status in Status if counts[status])
        return text + (f" ({self.kept[stage]} from before)" if self.kept[stage] else "")

    def share(self) -> float:
        """Of the expected work, in seconds of one core, what is done: 0 to 1."""
        left, done = self._work()
        return done / (left + done) if left + done else 0.0

    def overall(self) -> str:
        """``43 %, 2 failed, about 3 min left``; nothing where nothing is expected."""
        if not self._expected:
            return ""
        failed = sum(c[Status.FAILED] for c in self.by_status.values())
        left, _ = self._work()
        parts = [f"{100 * self.share():.0f} %", *([f"{failed} failed"] if failed else [])]
        if left:
            more = "" if all(e.is_known for e in self._expected.values()) else " for what is known so far"
            parts.append(f"about {duration(self._seconds_left(left))} left{more}")
        return ", ".join(parts)

    def _work(self) -> tuple[float, float]:
        """Seconds of one core that are left and that are done; what an earlier run did is no work."""
        left = sum(max(self.total(s) - self.finished[s], 0) * self._mean(s) for s in self.stages())
        done = sum((self.finished[s] - self.kept[s]) * self._mean(s) for s in self.stages())
        return left, done

    def _mean(self, stage: str) -> float:
        count = self.finished[stage]
        if count >= LEAST_MEASURED:
            return self._seconds[stage] / count
        expected = self._expected.get(stage)
        return expected.seconds if expected else self._seconds[stage] / max(count, 1)

    def _seconds_left(self, left: float) -> float:
        """From the pace so far, once there is one: it knows about workers that wait and about other work on the machine."""
        _, done = self._work()
        elapsed = time.monotonic() - self._begun
        planned = left / self._workers
        if done <= 0 or elapsed <= 0:
            return planned
        weight = self.share()
        return (1 - weight) * planned + weight * left * elapsed / done

    def as_json(self) -> dict[str, object]:
        """All counts, for whoever asks by HTTP."""
        stages = {
            s: {"total": self.total(s), "finished": self.finished[s], **{str(t): self.of(s, t) for t in Status}, "from_before": self.kept[s]}
            for s in self.stages()
        }  # fmt: skip
        return {"stages": stages, "share": round(self.share(), 4), "overall": self.overall()}


def duration(seconds: float) -> str:
    """
    >>> duration(90), duration(400), duration(40000)
    ('90 s', '7 min', '11.1 h')
    """
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
