"""A set of nodes in little memory: names of units by stage, and no pair for each of millions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from cityflow.flow.stage import Node, Nodes

NOTHING: frozenset[str] = frozenset()


class NodeSet:
    """Nodes that were added.

    >>> nodes = NodeSet()
    >>> nodes.add(("surface", "1_2"))
    >>> ("surface", "1_2") in nodes, ("outline", "1_2") in nodes, len(nodes)
    (True, False, 1)
    """

    def __init__(self) -> None:
        self._units: dict[str, set[str]] = {}
        self._forgotten = Counter[str]()

    def add(self, node: Node) -> None:
        stage, unit = node
        units = self._units.get(stage)
        if units is None:
            units = self._units[stage] = set()
        units.add(unit)

    def forget(self, stage: str, units: Iterable[str]) -> None:
        """Drop nodes that nobody asks for again; they count on."""
        known = self._units.get(stage, set())
        before = len(known)
        known.difference_update(units)
        self._forgotten[stage] += before - len(known)

    def __contains__(self, node: Node) -> bool:
        stage, unit = node
        return unit in self._units.get(stage, ())

    def lacking(self, nodes: Iterable[Node]) -> list[Node]:
        """Those of some nodes that are not in the set, each once, in their order.

        >>> known = NodeSet()
        >>> known.add(("surface", "1_2"))
        >>> known.lacking(Nodes(("surface", ["1_2", "1_3", "1_3"]))), known.lacking([("ingest", "1_2")])
        ([('surface', '1_3')], [('ingest', '1_2')])
        """
        if isinstance(nodes, Nodes):
            found = []
            for stage, units in nodes.by_stage:
                known = self._units.get(stage, NOTHING)
                if not known.issuperset(units):  # as nearly always
                    found += [(stage, unit) for unit in units if unit not in known]
        else:
            found = [node for node in nodes if node not in self]
        return found if len(found) < 2 else list(dict.fromkeys(found))

    def __len__(self) -> int:
        return sum(map(len, self._units.values()))

    def __iter__(self) -> Iterator[Node]:
        return ((stage, unit) for stage, units in self._units.items() for unit in units)

    def by_stage(self) -> Counter[str]:
        """How many there are of each stage, with those forgotten."""
        return Counter({stage: len(units) + self._forgotten[stage] for stage, units in self._units.items()})
