"""Which noded outlines stand wall to wall, and along which edges."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.outlines.rings import Rings
from cityflow.outlines.snapping import distinct


@dataclass(frozen=True, slots=True)
class SharedBoundary:
    """The edges that two outlines have in common.

    Attributes
    ----------
    first, second : positions in the list of outlines, first < second
    edges : (n, 2, 2) ends of each edge in the direction in which `first` runs, world metres
    length : metres
    """

    first: int
    second: int
    edges: FloatArray
    length: float


def shared_boundaries(outlines: Sequence[Outline]) -> list[SharedBoundary]:
    """Pairs of outlines with common edges, ordered by their positions.

    Only edges whose two vertices both outlines have, bit for bit, count: `noding.node_outlines` makes them so.
    """
    if not outlines:
        return []
    rings = Rings.of([outline.polygon for outline in outlines])
    _, place = distinct(rings.xy)
    ends = np.column_stack([place, place[rings.following()]])
    low, high, owner = ends.min(axis=1), ends.max(axis=1), rings.vertex_owner
    order = np.lexsort((owner, high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    a, b = order[:-1][same], order[1:][same]
    apart = owner[a] != owner[b]
    return _by_pair(rings, a[apart], b[apart])


def _by_pair(rings: Rings, a: np.ndarray, b: np.ndarray) -> list[SharedBoundary]:
    """Edges a of the first and b of the second outline, gathered by pair, along the first one's boundary."""
    owner, following = rings.vertex_owner, rings.following()
    order = np.lexsort((a, owner[b], owner[a]))
    a, b = a[order], b[order]
    edges = np.stack([rings.xy[a], rings.xy[following[a]]], axis=1)
    pair = np.column_stack([owner[a], owner[b]])
    cuts = np.flatnonzero((np.diff(pair, axis=0) != 0).any(axis=1)) + 1
    return [
        SharedBoundary(int(p[0, 0]), int(p[0, 1]), e, float(np.hypot(*(e[:, 1] - e[:, 0]).T).sum()))
        for p, e in zip(np.split(pair, cuts), np.split(edges, cuts), strict=True)
        if len(e)
    ]


def party_edges(outlines: Sequence[Outline]) -> dict[str, tuple[LineString, ...]]:
    """For each outline its edges that another one has, too, in its own direction; noded outlines share both vertices bit for bit."""
    rings = {o.id: [shapely.get_coordinates(r) for r in shapely.get_rings(o.polygon)] for o in outlines}
    edges = {i: [e for xy in mine for e in zip(map(tuple, xy[:-1].tolist()), map(tuple, xy[1:].tolist()), strict=True)]
             for i, mine in rings.items()}  # fmt: skip
    owners: dict[tuple[tuple[float, ...], ...], set[str]] = defaultdict(set)
    for i, mine in edges.items():
        for edge in mine:
            owners[tuple(sorted(edge))].add(i)
    return {i: tuple(LineString(e) for e in mine if len(owners[tuple(sorted(e))]) > 1) for i, mine in edges.items()}
