"""Looks up outputs of tasks for the tasks that read them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
KEPT = 10_000
"""Units whose outputs stay at hand, some megabytes: tasks of one tile read the same few, most of which have just ended."""


class Inputs:
    """Path → bytes and digest, from the records: those in ``work/`` name their unit, products are remembered as they come."""

    def __init__(self, store: Store, ledger: Ledger) -> None:
        self._ledger = ledger
        self._shared = SharedTexts(store)
        self._outputs: dict[Node, Mapping[str, Written]] = {}
        self._known: dict[str, Written] = {}  # those in ``work/`` by path
        self._products: dict[str, tuple[Node, Written]] = {}

    def learn(self, record: Record) -> None:
        """A record that stands: new, or of an earlier run."""
        node, written = (record.stage, record.unit), written_by(record)
        self._keep(node, written)
        self._products.update((p, (node, w)) for p, w in written.items() if p.startswith(PRODUCTS))

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
        known = self._known.get(path)
        if known is not None:
            return known
        if path in self._products:
            return self._products[path][1]
        node = self.maker(path)
        return None if node is None else self._left_by(node).get(path)

    def _left_by(self, node: Node) -> Mapping[str, Written]:
        if node not in self._outputs:
            record = self._ledger.latest(*node)
            self._keep(node, {} if record is None else written_by(record))
        return self._outputs[node]

    def _keep(self, node: Node, written: Mapping[str, Written]) -> None:
        """In the place of what was known of the node; who came first goes first."""
        self._forget(node)
        self._outputs[node] = written
        self._known.update((p, w) for p, w in written.items() if p.startswith(WORK))
        if len(self._outputs) > KEPT:
            self._forget(next(iter(self._outputs)))

    def _forget(self, node: Node) -> None:
        for path in self._outputs.pop(node, ()):
            self._known.pop(path, None)


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


def paths_in(value: Json) -> list[str]:
    """Every text in a JSON value that may be the path of a file of the RUN."""
    found, left = list[str](), [value]
    while left:
        inner = left.pop()
        if isinstance(inner, str):
            if inner.startswith((WORK, PRODUCTS)):
                found.append(inner)
        elif isinstance(inner, Mapping):
            left.extend(inner.keys())
            left.extend(inner.values())
        elif isinstance(inner, list | tuple):
            left.extend(inner)
    return found
