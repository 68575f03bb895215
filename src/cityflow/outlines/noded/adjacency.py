"""Adjacent noded outlines, and their common edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Outline
from cityflow.outlines.noded.rings import Rings
from cityflow.outlines.noded.snapping import distinct


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
    low, high, owner, order = _by_ends(rings, rings.following())
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
    if not outlines:
        return {}
    rings = Rings.of([outline.polygon for outline in outlines])
    following, owner = rings.following(), rings.vertex_owner
    common = np.flatnonzero(_common(rings, following))
    lines = shapely.linestrings(np.stack([rings.xy[common], rings.xy[following[common]]], axis=1))
    cuts = np.searchsorted(owner[common], np.arange(len(outlines) + 1))
    return {o.id: tuple(lines[a:b]) for o, (a, b) in zip(outlines, pairwise(cuts.tolist()), strict=True)}


def _common(rings: Rings, following: IntArray) -> BoolArray:
    """(N,) whether another polygon has the edge from a vertex to the next one, too, in either direction."""
    low, high, owner, order = _by_ends(rings, following)
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    edge = np.cumsum(np.r_[True, ~same]) - 1
    owners = np.bincount(edge[np.r_[True, ~same | (owner[order][1:] != owner[order][:-1])]])
    common = np.empty(len(order), bool)
    common[order] = owners[edge] > 1
    return common


def _by_ends(rings: Rings, following: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """(N,) numbers of the lower and of the higher end of each edge, its polygon, and the order by these three."""
    _, place = distinct(rings.xy)
    ends = np.column_stack([place, place[following]])
    low, high, owner = ends.min(axis=1), ends.max(axis=1), rings.vertex_owner
    return low, high, owner, np.lexsort((owner, high, low))
