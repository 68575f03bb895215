"""What the next task will need of memory: what its stage says, corrected by what its tasks have really taken."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from operator import itemgetter

from cityflow.flow.draft import Draft
from cityflow.flow.task import Task

QUIET = 0.95
"""Share of the tasks measured that took no more than the next is expected to need. A task that takes more asks for more when it does (`flow.room`)."""
STEP = 1.05
"""Measured memory is counted in steps of this ratio: a million tasks take no more room than a hundred."""

BYTES = itemgetter(0)
"""Of what is known of a file (`flow.damage.Written`)."""


class MemoryNeeds:
    """Peaks by stage and by size of the input files, which is counted in powers of two.

    The word of the stage counts as one measurement, so it holds until twenty tasks have been measured. Where no input of this size was met, smaller ones tell:
    an input so many times as large needs at most so many times as much. Of a draft no size is known: it is held against other drafts.
    No result depends on this.

    Parameters
    ----------
    usual_mb : stage → MB of a task, by experience; without it, the limit of the task
    """

    def __init__(self, usual_mb: Mapping[str, float]) -> None:
        self._usual_mb = usual_mb
        self._seen: defaultdict[tuple[str, bool], defaultdict[int, Counter[int]]] = defaultdict(
            lambda: defaultdict(Counter)
        )
        self._found: dict[tuple[tuple[str, bool], int, float], float] = {}  # since something was measured last

    def of(self, task: Task) -> float:
        """MB; never above the limit of the task."""
        kind, size, limit_mb = _kind(task), _size(task), task.limits.memory_mb
        found = self._found.get((kind, size, limit_mb))
        if found is None:
            found = self._found[kind, size, limit_mb] = self._of(task, self._seen.get(kind), size)
        return found

    def _of(self, task: Task, seen: Mapping[int, Counter[int]] | None, size: int) -> float:
        usual = min(self._usual_mb.get(task.stage, task.limits.memory_mb), task.limits.memory_mb)
        if not seen:
            return usual
        near = size if size in seen else max((s for s in seen if s < size), default=min(seen))
        found = _quantile(seen[near], usual if near == size else 0.0)
        if near < size:
            found = max(usual, found * 2.0 ** (size - near))
        return min(found, task.limits.memory_mb)

    def learn(self, task: Task, peak_mb: float) -> None:
        """A task has ended, or was killed at its limit."""
        if peak_mb > 0:
            self._found.clear()
            self._seen[_kind(task)][_size(task)][_step(peak_mb)] += 1


def _kind(task: Task) -> tuple[str, bool]:
    return task.stage, isinstance(task, Draft)


def _size(task: Task) -> int:
    """Power of two of the bytes of its input files."""
    return sum(map(BYTES, task.expected.values())).bit_length()


def _step(mb: float) -> int:
    return math.ceil(math.log(mb, STEP))


def _quantile(seen: Mapping[int, int], usual: float) -> float:
    counts = Counter(seen)
    if usual:
        counts[_step(usual)] += 1
    beyond = (1 - QUIET) * counts.total()
    for step in sorted(counts, reverse=True):
        beyond -= counts[step]
        if beyond < 0:
            return float(STEP**step)
    raise ValueError("nothing was measured")
