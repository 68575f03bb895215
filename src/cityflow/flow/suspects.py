"""Tasks whose workers died: each runs alone, and is named guilty where chance does not explain the deaths.

A worker takes down whatever it had at hand, and Dask counts that against all of it. While a suspect runs alone, every death of its worker is set against those
of the other workers, which have nothing to do: where machines die by themselves, theirs die as often.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from distributed import Client, KilledWorker

from cityflow.flow.draft import Draft
from cityflow.flow.stage import Node
from cityflow.flow.task import Task

CHANCE = 0.001
"""A task is named where chance gives its share of the deaths, or a larger one, more seldom than this."""
MOST_DEATHS = 20
"""A task that died so often while it ran alone is named whatever the others do: the run has to end."""


@dataclass(slots=True)
class Job:
    """A task on the scheduler; `flow.submission` completes it as it goes.

    Attributes
    ----------
    rank : of the task with which its work began (`flow.ready`): lower ones go first
    tries : that gave neither record nor death
    least_mb, need_mb, asked_mb : of memory: what a worker that was too small has shown; what it is expected to need; what the scheduler was asked for
    since, alone_s : when it was first submitted, and how long it has been alone since
    deaths, deaths_alone : of workers that had it; those while it ran alone
    """

    task: Task
    attempt: int
    rank: int = 0
    future: Any = None
    tries: int = 0
    least_mb: float = 0.0
    need_mb: float = 0.0
    asked_mb: float = 0.0
    since: float = field(default_factory=time.monotonic)
    alone_s: float = 0.0
    deaths: int = 0
    deaths_alone: int = 0

    @property
    def node(self) -> Node:
        return self.task.stage, self.task.unit

    @property
    def awaited(self) -> tuple[Node, ...]:
        """What has to be submitted before it."""
        return self.task.awaited if isinstance(self.task, Draft) else ()


class Suspects:
    """Those that wait for their turn, and the one that runs alone.

    Parameters
    ----------
    client : of the scheduler, which logs what became of its workers
    workers : how many there are, those included that start again just now
    """

    def __init__(self, client: Client, workers: Callable[[], int]) -> None:
        self._client, self._workers = client, workers
        self._waiting: deque[Job] = deque()
        self._began: float | None = None
        self._alone: Node | None = None

    def __bool__(self) -> bool:
        """Whether nothing else may be submitted."""
        return bool(self._waiting) or self._began is not None

    def next(self) -> list[Job]:
        """The next suspect, now that nothing is in flight; none where all have had their turn."""
        if not self._waiting:
            self._began = self._alone = None
            return []
        job = self._waiting.popleft()
        self._began, self._alone = time.monotonic(), job.node
        return [job]

    def died(self, job: Job, error: KilledWorker, prefix: str) -> str:
        """Dask has given a task up: it runs again, alone, as long as its deaths may be chance.

        Drafts that waited for a suspect are submitted together when it has ended: what dies then was not alone.

        Parameters
        ----------
        prefix : with which the keys of the task begin

        Returns
        -------
        why it is guilty; empty where it runs again
        """
        deaths = error.allowed_failures + 1
        job = replace(job, deaths=job.deaths + deaths)
        if self._began is None or job.node != self._alone:
            self._waiting.append(job)
            return ""
        alone_s = job.alone_s + time.monotonic() - self._began
        job = replace(job, deaths_alone=job.deaths_alone + deaths, alone_s=alone_s)
        since_s, workers = time.monotonic() - job.since, self._workers()
        others = _deaths_of_others(self._client.get_events("all"), since_s, prefix)
        exposure = alone_s / (alone_s + max(workers - 1, 0) * since_s)
        if job.deaths_alone < MOST_DEATHS and chance(job.deaths_alone, others, exposure) > CHANCE:
            self._waiting.append(job)
            return ""
        return (
            f"the worker died {job.deaths} times while it ran the task, {job.deaths_alone} of them with nothing else to do; "
            f"other workers died {others} times meanwhile"
        )


def chance(own: int, others: int, exposure: float) -> float:
    """Probability of `own` or more of all deaths, if workers die by themselves and `exposure` is the task's share of their time.

    >>> chance(2, 0, 0.5), round(chance(3, 1, 0.5), 3), chance(5, 0, 1.0)
    (0.25, 0.312, 1.0)
    """
    n = own + others
    return sum(math.comb(n, k) * exposure**k * (1 - exposure) ** (n - k) for k in range(own, n + 1))


def _deaths_of_others(events: Any, since_s: float, prefix: str) -> int:
    """Workers that were lost without having the task, by the scheduler's log and clock; its newest entry is of a moment ago."""
    lost = [
        (stamp, event) for stamp, event in events if event.get("action") == "remove-worker" and not event["expected"]
    ]
    newest = max((stamp for stamp, _ in lost), default=0.0)
    return sum(
        stamp >= newest - since_s and not any(str(key).startswith(prefix) for key in event["processing-tasks"])
        for stamp, event in lost
    )
