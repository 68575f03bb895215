"""Drafts that were submitted behind what they await, until the driver has heard of all of that."""

from __future__ import annotations

from typing import Any

from cityflow.flow.gates import Gates
from cityflow.flow.stage import Node
from cityflow.flow.suspects import Job


class Ahead:
    """Which drafts the driver may follow: what they await comes first, in whatever order the scheduler tells of the ends."""

    def __init__(self) -> None:
        self._gates: Gates[Node, Node] = Gates(_Forgotten())
        self._ended: dict[Node, tuple[Job, Any]] = {}

    def __len__(self) -> int:
        """Drafts on the scheduler that await something, as far as the driver has heard."""
        return len(self._gates) - len(self._ended)

    def add(self, job: Job) -> None:
        """A draft is about to be submitted."""
        self._gates.wait(job.node, job.awaited)

    def held(self, job: Job, result: Any) -> bool:
        """Whether a draft that has ended, or cannot be submitted, awaits something; `followed` hands it out then."""
        if not self._gates.is_waiting(job.node):
            return False
        self._ended[job.node] = job, result
        return True

    def followed(self, node: Node) -> list[tuple[Job, Any]]:
        """The driver has followed a task: drafts that have ended and await nothing any more, with their results."""
        return [self._ended.pop(free) for free in self._gates.fire(node) if free in self._ended]


class _Forgotten:
    """The past that nobody asks about: a draft awaits what is at work."""

    def add(self, event: Node, /) -> None: ...

    def __contains__(self, event: Node, /) -> bool:
        return False
