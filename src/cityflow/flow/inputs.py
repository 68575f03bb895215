"""Looks up outputs of tasks for the tasks that read them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from cityflow.flow.damage import Written
from cityflow.flow.ledger import Ledger
from cityflow.flow.outputs import digests_of
from cityflow.flow.records import unquoted
from cityflow.flow.shared import SharedTexts
from cityflow.flow.stage import Node
from cityflow.flow.store import Store
from cityflow.flow.task import Json, Record, Task

WORK, PRODUCTS = "work/", "products/"
KEPT = 500
"""Units whose outputs stay at hand: tasks of one tile read the same few."""


class Inputs:
    """Path → bytes and digest, from the records: those in ``work/`` name their unit, products are remembered as they come."""

    def __init__(self, store: Store, ledger: Ledger) -> None:
        self._ledger = ledger
        self._shared = SharedTexts(store)
        self._outputs: OrderedDict[Node, Mapping[str, Written]] = OrderedDict()
        self._products: dict[str, tuple[Node, Written]] = {}

    def learn(self, record: Record) -> None:
        """A record that stands: new, or of an earlier run."""
        node = record.stage, record.unit
        self._outputs.pop(node, None)
        self._products.update((p, (node, w)) for p, w in written_by(record).items() if p.startswith(PRODUCTS))

    def ready(self, task: Task) -> Task:
        """The task as it is sent: with what is known of its files; what it shares with others is written."""
        return replace(self._shared.stored(task), expected=self.of(task))

    def of(self, task: Task) -> dict[str, Written]:
        """What is known of the files that the arguments of a task name."""
        found = {path: self._find(path) for path in paths_in(task.arguments)}
        return {path: written for path, written in found.items() if written is not None}

    def left_by(self, nodes: Iterable[Node]) -> dict[str, Written]:
        """What is known of the files of some tasks."""
        return {path: written for node in nodes for path, written in self._left_by(node).items()}

    def get(self, path: str, /) -> Written | None:
        """What was written under a path, for readers that look one up."""
        return self._find(path)

    def maker(self, path: str) -> Node | None:
        """Stage and unit that left a file."""
        return self._products[path][0] if path in self._products else node_of(path)

    def _find(self, path: str) -> Written | None:
        if path in self._products:
            return self._products[path][1]
        node = self.maker(path)
        return None if node is None else self._left_by(node).get(path)

    def _left_by(self, node: Node) -> Mapping[str, Written]:
        if node not in self._outputs:
            record = self._ledger.latest(*node)
            self._outputs[node] = {} if record is None else written_by(record)
            if len(self._outputs) > KEPT:
                self._outputs.popitem(last=False)
        self._outputs.move_to_end(node)
        return self._outputs[node]


class LeftBehind:
    """The same for readers: what the given records say of files in ``work/``."""

    def __init__(self, records: Iterable[Record]) -> None:
        self._records = {(r.stage, r.unit): r for r in records}

    def get(self, path: str, /) -> Written | None:
        node = node_of(path)
        record = None if node is None else self._records.get(node)
        return None if record is None or path not in record.sizes else (record.sizes[path], digests_of(record)[path])


def node_of(path: str) -> Node | None:
    """The unit that a path in ``work/`` names."""
    parts = path.split("/", 3)
    return (unquoted(parts[1]), unquoted(parts[2])) if path.startswith(WORK) and len(parts) == 4 else None


def written_by(record: Record) -> dict[str, Written]:
    """Nothing of records of older versions, which say no sizes."""
    return {path: (record.sizes[path], digest) for path, digest in digests_of(record).items() if path in record.sizes}


def paths_in(value: Json) -> Iterator[str]:
    """Every text in a JSON value that may be the path of a file of the RUN."""
    if isinstance(value, str):
        if value.startswith((WORK, PRODUCTS)):
            yield value
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from paths_in(key)
            yield from paths_in(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from paths_in(inner)
