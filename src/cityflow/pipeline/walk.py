"""Finds the tasks that become ready when one ends, by the needs of the stages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Generic, TypeVar

from cityflow.flow.gates import Gates
from cityflow.flow.node_set import NodeSet
from cityflow.flow.stage import START, Node, Stage, nobody
from cityflow.flow.task import Task

C = TypeVar("C")


class Walk(Generic[C]):
    """Tasks in the order in which they become ready, each once.

    Parameters
    ----------
    stages : in the order of the flow
    context : what their functions ask
    """

    def __init__(self, stages: Sequence[Stage[C]], context: C) -> None:
        self.stages = {stage.name: stage for stage in stages}
        self._starting = [stage for stage in stages if stage.starts is not nobody]
        self._context = context
        self._gates: Gates[tuple[Node, int], Node] = Gates(NodeSet())
        self._wanted = NodeSet()

    def begin(self) -> Iterator[Task]:
        """What can start at once."""
        yield from self._started_by(START)

    def want(self, nodes: Iterable[Node]) -> Iterator[Task]:
        """What can start at once of these tasks and of all that they need."""
        for node in nodes:
            if node not in self._wanted:
                self._wanted.add(node)
                yield from self._go_on(node, 0)

    def ended(self, node: Node) -> Iterator[Task]:
        """What a task that has ended sets going, and what it sets free."""
        yield from self._started_by(node)
        yield from self._open(node)

    def wanted(self) -> Counter[str]:
        """Tasks by stage that somebody has asked for so far."""
        return self._wanted.by_stage()

    def foreseen(self, nodes: Iterable[Node]) -> set[Node]:
        """These nodes and all that they need as far as it can be told before anything has run."""
        found = set(nodes)
        left = list(found)
        while left:
            stage, unit = left.pop()
            for step in self.stages[stage].needs[:1]:
                below = [n for n in step(self._context, unit) if n not in found]
                found.update(below)
                left.extend(below)
        return found

    def _started_by(self, node: Node) -> Iterator[Task]:
        for stage in self._starting:
            yield from self.want((stage.name, unit) for unit in stage.starts(self._context, node))

    def _go_on(self, node: Node, step: int) -> Iterator[Task]:
        """From this step of what the node waits for to the first that is not there."""
        name, unit = node
        stage = self.stages[name]
        for number in range(step, len(stage.needs)):
            needs = list(stage.needs[number](self._context, unit))
            yield from self.want(needs)
            if not self._gates.wait((node, number), needs):
                return
        yield from self._made(node)

    def _made(self, node: Node) -> Iterator[Task]:
        """The task of a node that waits for nothing any more."""
        name, unit = node
        task = self.stages[name].task(self._context, unit)
        if task is not None:
            yield task
        else:
            yield from self._open(node)

    def _open(self, ended: Node) -> Iterator[Task]:
        for node, step in self._gates.fire(ended):
            yield from self._go_on(node, step + 1)
