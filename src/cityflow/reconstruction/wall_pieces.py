"""A wall cut along the outline of the wall on its other side: the common part, and what stands free above and below."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.core.building import VERTEX_DECIMALS
from cityflow.reconstruction.wall_profiles import TIED, Node, Profile, Spot, compare

SAME_SPOT = 2e-3
"""A cut that comes nearer than this (m) to an existing vertex of the wall goes through it."""


@dataclass(frozen=True, slots=True)
class WallPieces:
    """Rings of spots, from the start of the edge along the bottom, back along the top.

    Attributes
    ----------
    common : what both walls share
    free : the rest
    """

    common: list[Spot]
    free: list[list[Spot]]


def cut_wall(own: Profile, other: Profile) -> WallPieces | None:
    """Pieces of a wall; None where the two walls do not touch, or only within `TIED` somewhere along the edge."""
    nodes = compare(own, other)
    bottom = max(own.floor, other.floor)
    lows = [min(n.after, n.other_after) for n in nodes[:-1]] + [min(n.before, n.other_before) for n in nodes[1:]]
    if min(lows) - bottom <= TIED:
        return None
    cutter = _Cutter(nodes)
    foot, free = cutter.foot(own.floor, other.floor)
    top = [spot for k in range(len(nodes) - 1) for spot in (cutter.low(k, True), cutter.low(k + 1, False))]
    free += [cutter.above(first, last) for first, last in cutter.runs()]
    rings = cutter.with_all_spots([[*foot, *reversed(top)], *free])
    return WallPieces(rings[0], [ring for ring in rings[1:] if len(ring) > 2])


class _Cutter:
    """Spots at the nodes, each place only once."""

    def __init__(self, nodes: list[Node]) -> None:
        self.nodes = nodes
        self.spots: list[list[Spot]] = [list(node.own) for node in nodes]

    def spot(self, k: int, z: float) -> Spot:
        """The wall's own vertex at this height, or a new one."""
        for known in self.spots[k]:
            if abs(known.z - z) <= SAME_SPOT:
                return known
        node = self.nodes[k]
        new = Spot(k, node.x, node.y, round(z, VERTEX_DECIMALS))
        self.spots[k].append(new)
        return new

    def foot(self, floor: float, other_floor: float) -> tuple[list[Spot], list[list[Spot]]]:
        """Bottom of the common part, and the free strip below where the other floor is higher."""
        last = len(self.nodes) - 1
        own = [self.nodes[0].own[0], self.nodes[last].own[-1]]
        if other_floor - floor <= TIED:
            return own, []
        foot = [self.spot(0, other_floor), self.spot(last, other_floor)]
        return foot, [[*own, foot[1], foot[0]]]

    def difference(self, k: int, after: bool) -> float:
        """Own height over the other one's, on one side of a node."""
        node = self.nodes[k]
        return node.after - node.other_after if after else node.before - node.other_before

    def own(self, k: int, after: bool) -> Spot:
        node = self.nodes[k]
        if node.own:
            return node.own[-1 if after else 0]
        return self.spot(k, node.after if after else node.before)

    def low(self, k: int, after: bool) -> Spot:
        """Top of the common part on one side of a node: the other profile where the own wall is above it there."""
        node = self.nodes[k]
        if self.difference(k, after) <= TIED or not self.is_above(k if after else k - 1):
            return self.own(k, after)
        return self.spot(k, node.other_after if after else node.other_before)

    def is_above(self, k: int) -> bool:
        """True where the own wall is the higher one between nodes k and k + 1."""
        start, end = self.difference(k, True), self.difference(k + 1, False)
        return (start if abs(start) > abs(end) else end) > TIED

    def runs(self) -> list[tuple[int, int]]:
        """First and last nodes of the free parts above the other wall."""
        runs: list[tuple[int, int]] = []
        for k in range(len(self.nodes) - 1):
            if not self.is_above(k):
                continue
            if runs and runs[-1][1] == k and self._open(k):
                runs[-1] = (runs[-1][0], k + 1)
            else:
                runs.append((k, k + 1))
        return runs

    def _open(self, k: int) -> bool:
        top = min(self.own(k, False).z, self.own(k, True).z)
        return top - max(self.low(k, False).z, self.low(k, True).z) > TIED

    def above(self, first: int, last: int) -> list[Spot]:
        """Ring of a free part between two nodes."""
        bottom = [spot for k in range(first, last) for spot in (self.low(k, True), self.low(k + 1, False))]
        top = [spot for k in range(first, last) for spot in (self.own(k, True), self.own(k + 1, False))]
        return [*bottom, *reversed(top)]

    def with_all_spots(self, rings: list[list[Spot]]) -> list[list[Spot]]:
        """Rings with every spot that lies on their vertical edges, none twice in a row."""
        return [_without_repeats(self._filled(ring)) for ring in rings]

    def _filled(self, ring: list[Spot]) -> list[Spot]:
        filled: list[Spot] = []
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            filled.append(a)
            if a.node == b.node and a != b:
                low, high = min(a.z, b.z), max(a.z, b.z)
                between = sorted((s for s in self.spots[a.node] if low < s.z < high), key=lambda s: s.z)
                filled.extend(between if a.z < b.z else reversed(between))
        return filled


def _without_repeats(ring: list[Spot]) -> list[Spot]:
    """A ring without spots that follow themselves, and without spikes (there and back again)."""
    kept: list[Spot] = []
    for spot in ring:
        if kept and kept[-1] == spot:
            continue
        if len(kept) > 1 and kept[-2] == spot:
            kept.pop()
            continue
        kept.append(spot)
    while len(kept) > 1 and kept[0] == kept[-1]:
        kept.pop()
    while len(kept) > 2 and kept[1] == kept[-1]:
        kept = kept[2:]
    return kept
