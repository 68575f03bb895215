"""A source of chains: each task adds up what those before it have left, and is drafted while they are at work."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from cityflow.flow.draft import Draft
from cityflow.flow.stage import Node
from cityflow.flow.task import Record, Task
from flow.toy_stages import toy

Graph = Mapping[Node, Sequence[Node]]


@dataclass(frozen=True)
class Sum:
    """The recipe of a task."""

    node: Node
    known: tuple[Record, ...]
    changes: Mapping[str, Any]

    def __call__(self, records: Sequence[Record]) -> Task:
        if self.changes.get("broken"):
            raise LookupError("a bug of ours")
        stage, unit = self.node
        every = sorted([*self.known, *records], key=lambda r: (r.stage, r.unit))
        inputs = {f"{r.stage}-{r.unit}": "".join(r.outputs.values()) or str(r.status) for r in every}
        arguments = {
            "from": [path for r in every for path in r.outputs],
            "missing": [f"{r.stage}-{r.unit}" for r in every if not r.outputs],
            "sleep_s": self.changes.get("sleep_s", 0),
        }
        function = self.changes.get("function", "total")
        return toy(unit, function, stage, inputs=inputs, arguments=arguments, version=self.changes.get("version", 1))


@dataclass
class Chains:
    """Tasks that read what others leave, in the order of the graph.

    Parameters
    ----------
    graph : stage and unit → those that it reads
    changes : of some: function, version, sleep_s
    ahead : whether they are drafted before what they read has ended
    """

    graph: Graph
    changes: Mapping[Node, Mapping[str, Any]] = field(default_factory=dict)
    ahead: bool = True
    told: list[Node] = field(default_factory=list)
    records: dict[Node, Record] = field(default_factory=dict)
    drafted: list[Node] = field(default_factory=list)

    def initial(self) -> Iterator[Task]:
        yield from self._ready(lambda node: self.ahead or not self.graph[node])

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        node = task.stage, task.unit
        self.told.append(node)
        assert all(read in self.records for read in self.graph[node]), "followed before what it reads"
        self.records[node] = record
        # a list, since each is told once, when the last that it reads has ended
        return iter(() if self.ahead else list(self._ready(lambda n: node in self.graph[n] and self._has_all(n))))

    def _has_all(self, node: Node) -> bool:
        return all(read in self.records for read in self.graph[node])

    def _ready(self, chosen: Callable[[Node], bool]) -> Iterator[Task]:
        for node in self.graph:
            if chosen(node):
                yield self.task(node)

    def task(self, node: Node) -> Task:
        awaited = tuple(n for n in self.graph[node] if n not in self.records)
        ended = tuple(n for n in self.graph[node] if n in self.records)
        recipe = Sum(node, tuple(self.records[n] for n in ended), self.changes.get(node, {}))
        if not awaited:
            return recipe(())
        self.drafted.append(node)
        made = partial(self.task, node)
        return Draft(*node, "", 1, awaited=awaited, ended=ended, recipe=pickle.dumps(recipe), made=made)


def chain(*stages: str, unit: str = "1") -> Graph:
    """Each stage reads the one before."""
    nodes = [(stage, unit) for stage in stages]
    return {node: nodes[max(0, k - 1) : k] for k, node in enumerate(nodes)}
