"""Tasks that wait to be submitted: what was begun first is brought to its end first."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator

from cityflow.flow.task import Task


class Ready:
    """Tasks with their ranks, pulled lazily.

    A task that waits for nothing gets the next rank; what a task sets free has the rank of that task. Tasks of a lower rank come first, of the same rank
    those that became ready last; new ones begin where nothing else is ready. So few iterators are open, and few tiles are begun at a time.

    Parameters
    ----------
    initial : tasks that wait for nothing
    """

    def __init__(self, initial: Iterable[Task]) -> None:
        self._initial = iter(initial)
        self._freed: list[tuple[int, int, Iterator[Task]]] = []
        self._begun = self._added = 0

    def add(self, tasks: Iterable[Task], rank: int) -> None:
        """What has become ready because a task of this rank has ended."""
        self._added += 1
        heapq.heappush(self._freed, (rank, -self._added, iter(tasks)))

    def next(self) -> tuple[Task, int] | None:
        """A task and its rank; None where nothing is ready."""
        while self._freed:
            rank, _, tasks = self._freed[0]
            if (task := next(tasks, None)) is not None:
                return task, rank
            heapq.heappop(self._freed)
        if (task := next(self._initial, None)) is None:
            return None
        self._begun += 1
        return task, self._begun
