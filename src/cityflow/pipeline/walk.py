"""Finds the tasks that become ready when one ends, by the needs of the stages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Generic, TypeVar

from cityflow.flow.draft import Draft
from cityflow.flow.gates import Gates
from cityflow.flow.node_set import NodeSet
from cityflow.flow.stage import START, Node, Nodes, Stage, nobody, turn_of
from cityflow.flow.task import Task

C = TypeVar("C")


class Walk(Generic[C]):
    """Tasks in the order in which they become ready, each once.

    Parameters
    ----------
    stages : in the order of the flow
    context : what their functions ask

    Attributes
    ----------
    ahead : whether tasks are drafted as soon as all that they wait for has been handed out, where their stage can; else every task comes
        when what it waits for has ended
    """

    def __init__(self, stages: Sequence[Stage[C]], context: C) -> None:
        self.stages = {stage.name: stage for stage in stages}
        self._beginning = [stage for stage in stages if stage.begins is not nobody]
        self._starting = [stage for stage in stages if stage.starts is not nobody]
        self._context = context
        self._ended = ended = NodeSet()
        self._gates: Gates[tuple[Node, int], Node] = Gates(ended)
        self._wanted = NodeSet()
        self.ahead = False
        self._handed_out = _HandedOut(ended)
        self._drafts: Gates[Node, Node] = Gates(self._handed_out)

    def begin(self, places: Iterable[str] = ()) -> Iterator[Task]:
        """What can start at once: what waits for no place, then place by place, each with all that it needs."""
        for turn in (START, *map(turn_of, places)):
            for stage in self._beginning:
                yield from self.want((stage.name, unit) for unit in stage.begins(self._context, turn))

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

    def forget(self, stage: str, units: Iterable[str]) -> None:
        """These have ended, and nobody will ask for them or wait for them again."""
        self._wanted.forget(stage, units)
        self._ended.forget(stage, units)

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

    def _go_on(self, node: Node, step: int, *, ahead: bool = True) -> Iterator[Task]:
        """From this step of what the node waits for to the first that is not there; before the first step, it may be drafted."""
        name, unit = node
        stage = self.stages[name]
        for number in range(step, len(stage.needs)):
            needs = stage.needs[number](self._context, unit)
            if not isinstance(needs, Nodes):
                needs = tuple(needs)
            if lacking := self._wanted.lacking(needs):
                yield from self.want(lacking)
            if self.ahead and ahead and number == 0 and stage.draft is not None:
                if self._drafts.wait(node, needs):
                    yield from self._drafted(node)
                return
            if left := self._ended.lacking(needs):
                self._gates.wait_for((node, number), left)
                return
        yield from self._made(node)

    def _drafted(self, node: Node) -> Iterator[Task]:
        """The draft of a node whose needs have been handed out; where its stage cannot tell yet, it waits until they have ended."""
        name, unit = node
        stage = self.stages[name]
        assert stage.draft is not None
        task = stage.draft(self._context, unit)
        if task is not None:
            yield from self._hand_out(node, task)
        else:
            yield from self._go_on(node, 0, ahead=False)

    def _made(self, node: Node) -> Iterator[Task]:
        """The task of a node that waits for nothing any more."""
        name, unit = node
        task = self.stages[name].task(self._context, unit)
        if task is not None:
            yield from self._hand_out(node, task)
        else:
            yield from self._open(node)

    def _hand_out(self, node: Node, task: Task) -> Iterator[Task]:
        """A task, then the drafts that were waiting for it to be on its way."""
        assert not isinstance(task, Draft) or all(n in self._handed_out for n in task.awaited), (
            f"{task.name} awaits more than its stage needs"
        )
        yield task
        if self.ahead:
            for free in self._drafts.fire(node):
                yield from self._drafted(free)

    def _open(self, ended: Node) -> Iterator[Task]:
        for node, step in self._gates.fire(ended):
            yield from self._go_on(node, step + 1)
        if self.ahead:
            for free in self._drafts.fire(ended):
                yield from self._drafted(free)
            self._handed_out.forget(ended)


class _HandedOut:
    """Nodes whose tasks are at work or have ended; the latter are `ended`."""

    def __init__(self, ended: NodeSet) -> None:
        self._ended, self._at_work = ended, set[Node]()

    def add(self, node: Node, /) -> None:
        if node not in self._ended:
            self._at_work.add(node)

    def forget(self, node: Node) -> None:
        """It has ended."""
        self._at_work.discard(node)

    def __contains__(self, node: Node, /) -> bool:
        return node in self._at_work or node in self._ended
