"""Looks up outputs of tasks for the tasks that read them."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import NoneType

from cityflow.flow.damage import Written
from cityflow.flow.in_place import left_list
from cityflow.flow.kept import kept
from cityflow.flow.ledger import Ledger
from cityflow.flow.outputs import digests_of
from cityflow.flow.records import unquoted
from cityflow.flow.shared import SharedTexts
from cityflow.flow.stage import Node
from cityflow.flow.store import Store
from cityflow.flow.task import Json, Record, Task

WORK, PRODUCTS = FOLDERS = "work/", "products/"
TREES = (dict, list, tuple)
PLAIN = frozenset((str, int, float, bool, NoneType))
KEPT = 10_000
"""Units of a stage whose outputs stay at hand, some megabytes: tasks of one tile read the same few, most of which have just ended."""


class Inputs:
    """Path → bytes and digest, from the records: those in ``work/`` name their unit, products are remembered as they come."""

    def __init__(self, store: Store, ledger: Ledger) -> None:
        self._ledger, self._store = ledger, store
        self._shared = SharedTexts(store)
        # by stage and unit; a plain dict looks through the places of all that went before it finds its first
        self._outputs: dict[str, OrderedDict[str, Mapping[str, Written]]] = {}
        self._known: dict[str, Written] = {}  # those in ``work/`` by path
        self._products: dict[str, tuple[Node, Written]] = {}
        self._lists: dict[str, tuple[str, Written]] = {}  # of files written in place, by the name that inputs have
        self._before = frozenset(ledger.stages())

    def learn(self, record: Record) -> None:
        """A record that stands: new, or of an earlier run."""
        node, written = (record.stage, record.unit), written_by(record)
        self._keep(node, written)
        for path, of in written.items():
            if path.startswith(PRODUCTS):
                self._products[path] = node, of
        self._note_in_place(record)

    def ready(self, task: Task) -> Task:
        """The task as it is sent: with what is known of its files; what it shares with others is written."""
        return replace(self._shared.stored(task), expected=self.of(task))

    def of(self, task: Task) -> dict[str, Written]:
        """What is known of the files that the arguments of a task name."""
        paths, known_of = paths_in(task.arguments), self._known.get
        found = {path: written for path in paths if (written := known_of(path) or self._find(path)) is not None}
        lists, before = self._lists, self._before
        if lists or before:
            for name in task.inputs:  # hundreds, of a texture
                known = lists[name] if name in lists else self._list_before(name) if before else None
                if known is not None:
                    found[known[0]] = known[1]
        return found

    def left_by(self, nodes: Iterable[Node]) -> dict[str, Written]:
        """What is known of the files of some tasks."""
        return {path: written for node in nodes for path, written in self._left_by(node).items()}

    def get(self, path: str, /) -> Written | None:
        """What was written under a path, for readers that look one up."""
        return self._find(path)

    def maker(self, path: str) -> Node | None:
        """Stage and unit that left a file."""
        if path in self._products:
            return self._products[path][0]
        if path.startswith(FOLDERS):
            return node_of(path)
        nodes = ((stage, unit) for stage, _, unit in (name.partition(" ") for name in self._lists))
        return next((node for node in nodes if path in self._left_by(node)), None)

    def _note_in_place(self, record: Record) -> None:
        """Chunks of a surface, and what else was written by other means: no argument names them."""
        if record.sums and self._store.is_local:
            in_place = {path: (record.sizes[path], digest) for path, digest in record.sums.items()}
            self._lists[f"{record.stage} {record.unit}"] = left_list(self._store, in_place)

    def _list_before(self, name: str) -> tuple[str, Written] | None:
        """Of a task of an earlier run that this one does not come to."""
        stage, is_node, unit = name.partition(" ")
        if not is_node or stage not in self._before or (record := self._ledger.latest(stage, unit)) is None:
            return None
        self._note_in_place(record)
        if record.outputs and not record.sums:
            self._before -= {stage}  # its tasks write nothing in place
        return self._lists.get(name)

    def _find(self, path: str) -> Written | None:
        known = self._known.get(path)
        if known is not None:
            return known
        if path in self._products:
            return self._products[path][1]
        node = self.maker(path)
        return None if node is None else self._left_by(node).get(path)

    def _left_by(self, node: Node) -> Mapping[str, Written]:
        stage, unit = node
        if unit not in self._outputs.get(stage, ()):
            record = self._ledger.latest(stage, unit)
            self._keep(node, {} if record is None else written_by(record))
        return self._outputs[stage][unit]

    def _keep(self, node: Node, written: Mapping[str, Written]) -> None:
        """In the place of what was known of the node; who came first in its stage goes first."""
        stage, unit = node
        units = self._outputs.setdefault(stage, OrderedDict())
        self._forget(units, unit)
        units[unit] = written
        for path, of in written.items():
            if path.startswith(WORK):
                self._known[path] = of
        if len(units) > KEPT:
            self._forget(units, next(iter(units)))

    def _forget(self, units: OrderedDict[str, Mapping[str, Written]], unit: str) -> None:
        for path in units.pop(unit, ()):
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
    digests, sizes = digests_of(record) if record.sums else record.outputs, record.sizes
    return {path: (sizes[path], digest) for path, digest in digests.items() if path in sizes}


def paths_in(arguments: Mapping[str, Json]) -> list[str]:
    """Every text in the arguments of a task that may be the path of a file of the RUN.

    >>> paths_in({"hulls": {"a": "work/reconstruct/a/1/hull"}, "crs": "EPSG:28992", "pieces": ["work/ingest/f/2/0_0.laz"]})
    ['work/reconstruct/a/1/hull', 'work/ingest/f/2/0_0.laz']
    """
    found = _paths_among([*arguments, *arguments.values()])
    for value in arguments.values():
        if not isinstance(value, TREES) or not value:
            continue
        texts = [*value, *value.values()] if isinstance(value, dict) else value
        if PLAIN.issuperset(map(type, texts)):  # as quick as to look whether it was searched before
            found += _paths_among(texts)
        else:
            found += _paths_within(value)
    return found


def _paths_among(values: Iterable[Json]) -> list[str]:
    """The same of values alone, not of trees among them."""
    return [each for each in values if isinstance(each, str) and each.startswith(FOLDERS)]


@kept
def _paths_within(value: Json) -> list[str]:
    """The same of a tree; one that many tasks share is searched once."""
    found, left = list[str](), [value]
    while left:
        inner = left.pop()
        values = [*inner, *inner.values()] if isinstance(inner, dict) else inner
        found += _paths_among(values)
        if not PLAIN.issuperset(map(type, values)):  # numbers of cells are many
            left += [each for each in values if isinstance(each, TREES)]
    return found
