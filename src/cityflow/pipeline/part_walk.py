"""Finds the tasks that depend on a few, and no others: what these cannot change stands as its record left it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from typing import Protocol, TypeVar

from cityflow.flow.stage import START, Node, Stage, turn_of
from cityflow.flow.task import Task
from cityflow.pipeline.walk import Walk

C = TypeVar("C")


class Standing(Protocol):
    """What a walk over a part asks of what stands.

    Attributes
    ----------
    chosen : tasks that run again
    """

    chosen: AbstractSet[Node]

    def may_change(self, node: Node) -> bool:
        """Whether what is chosen may reach the node: quick, and true in doubt."""

    def is_due(self, node: Node) -> bool:
        """Whether its task is made whatever becomes of what it needs: it is chosen, or something acts on it that is no task."""

    def has(self, node: Node) -> bool:
        """Whether it has a record."""

    def stand(self, node: Node) -> None:
        """The node is done as its record says."""

    def prepare(self, node: Node) -> None:
        """The task of a node is made next."""

    def has_always_a_task(self, node: Node) -> bool:
        """Whether the node has something to do whatever it is made of, so that it is unfinished where it has no record."""

    def named_by(self, node: Node) -> Iterable[Node]:
        """Nodes that have named this one, beyond what it needs."""


class PartWalk(Walk[C]):
    """A walk that goes into the needs of a node only where it may change, and makes its task only where one of them was made.

    What cannot change and is unfinished is not gone into either, however much of the city that is.

    Attributes
    ----------
    made : nodes whose tasks were made
    left : nodes without a record that nothing here changes: they are for another run, and so is what waits for them
    """

    def __init__(self, stages: Sequence[Stage[C]], context: C, standing: Standing) -> None:
        super().__init__(stages, context)
        self._standing = standing
        self.made: set[Node] = set()
        self.left: set[Node] = set()

    def begin(self, places: Iterable[str] = ()) -> Iterator[Task]:
        """What stands at the end of the flow and may change, as far as an earlier run has come to it; place by place."""
        turns, context = (START, *map(turn_of, places)), self._context
        goals = [
            (stage.name, unit) for turn in turns for stage in self._beginning for unit in stage.begins(context, turn)
        ]
        reached = [node for node in goals if self._standing.may_change(node)]
        self.left.update(node for node in reached if not self._done_before(node))
        yield from self.want(node for node in reached if self._done_before(node))

    def want(self, nodes: Iterable[Node]) -> Iterator[Task]:
        for node in nodes:
            if node in self._wanted:
                continue
            self._wanted.add(node)
            standing = self._standing
            if node in standing.chosen or standing.may_change(node):
                yield from self._go_on(node, 0)
            elif standing.has(node):
                standing.stand(node)
                yield from self._open(node)
            elif standing.has_always_a_task(node):
                self.left.add(node)
            else:
                yield from self._go_on(node, 0)

    def ended(self, node: Node, *, changed: bool = True) -> Iterator[Task]:
        """What a task that has ended sets going, and what it sets free; nothing follows from one that has left what was there."""
        if changed:
            yield from self._started_by(node)
        else:
            self.made.discard(node)
        yield from self._open(node)

    def under_way(self, nodes: Iterable[Node]) -> set[Node]:
        """Those of some nodes that do not stand yet."""
        return {node for node in nodes if node not in self._ended}

    def waiting(self) -> set[Node]:
        """What waits for something that is left for another run."""
        return {node for node, _ in self._gates.waiting()}

    def _done_before(self, node: Node) -> bool:
        return node in self._standing.chosen or self._standing.has(node)

    def _made(self, node: Node) -> Iterator[Task]:
        if self._follows(node):
            self.made.add(node)
            self._standing.prepare(node)
            yield from super()._made(node)
        elif self._standing.has(node):
            self._standing.stand(node)
            yield from self._open(node)
        elif self.stages[node[0]].task(self._context, node[1]) is None:
            yield from self._open(node)
        else:
            self.left.add(node)

    def _follows(self, node: Node) -> bool:
        """Whether the node is due, or something that it is made from was made."""
        if self._standing.is_due(node) or not self.made.isdisjoint(self._standing.named_by(node)):
            return True
        name, unit = node
        return any(not self.made.isdisjoint(step(self._context, unit)) for step in self.stages[name].needs)
