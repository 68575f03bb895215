"""A set of nodes in little memory: names of units by stage, and no pair for each of millions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from cityflow.flow.stage import Node


class NodeSet:
    """Nodes that were added.

    >>> nodes = NodeSet()
    >>> nodes.add(("surface", "1_2"))
    >>> ("surface", "1_2") in nodes, ("outline", "1_2") in nodes, len(nodes)
    (True, False, 1)
    """

    def __init__(self) -> None:
        self._units: dict[str, set[str]] = {}

    def add(self, node: Node) -> None:
        stage, unit = node
        units = self._units.get(stage)
        if units is None:
            units = self._units[stage] = set()
        units.add(unit)

    def __contains__(self, node: Node) -> bool:
        stage, unit = node
        return unit in self._units.get(stage, ())

    def __len__(self) -> int:
        return sum(map(len, self._units.values()))

    def __iter__(self) -> Iterator[Node]:
        return ((stage, unit) for stage, units in self._units.items() for unit in units)

    def by_stage(self) -> Counter[str]:
        """How many there are of each stage."""
        return Counter({stage: len(units) for stage, units in self._units.items()})
