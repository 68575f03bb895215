"""Minimum cuts of small graphs with whole-numbered capacities, in compiled code and callable from it.

SciPy's maximum flow has capacities of 32 bits and cannot be called from compiled code, where an expansion move needs a cut for
each label; so the flow is found here, by blocking flows in layers of equal distance from the source (Dinic 1970).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.kernels import njit


class _Residual(NamedTuple):
    """Arcs and their opposites by the node that they leave.

    Attributes
    ----------
    first : (N + 1,) int64, where the arcs of a node begin
    to, back, left : (2A,) int64, where an arc leads, its opposite, the capacity that is left
    """

    first: IntArray
    to: IntArray
    back: IntArray
    left: IntArray


@njit(cache=True, nogil=True)
def min_cut(tail: IntArray, head: IntArray, room: IntArray, nodes: int) -> BoolArray:
    """(N,) nodes on the source's side of a minimum cut: the largest such side, which is one and the same whatever flow is found.

    Parameters
    ----------
    tail, head, room : (A,) int64, arcs and their capacities, none negative
    nodes : number of nodes, source and sink included, which are the last two
    """
    graph = _residual(tail, head, room, nodes)
    level = np.empty(nodes, np.int64)
    while _layers(graph, level):
        _block(graph, level)
    return _not_reaching(graph, nodes - 1)


@njit(cache=True, nogil=True)
def _residual(tail: IntArray, head: IntArray, room: IntArray, nodes: int) -> _Residual:
    arcs = len(tail)
    first = np.zeros(nodes + 1, np.int64)
    for a in range(arcs):
        first[tail[a] + 1] += 1
        first[head[a] + 1] += 1
    first = np.cumsum(first)
    place = first[:-1].copy()
    to, back, left = np.empty(2 * arcs, np.int64), np.empty(2 * arcs, np.int64), np.empty(2 * arcs, np.int64)
    for a in range(arcs):
        p, q = place[tail[a]], place[head[a]]
        to[p], to[q], left[p], left[q], back[p], back[q] = head[a], tail[a], room[a], 0, q, p
        place[tail[a]] += 1
        place[head[a]] += 1
    return _Residual(first, to, back, left)


@njit(cache=True, nogil=True)
def _layers(graph: _Residual, level: IntArray) -> bool:
    """Set the number of arcs from the source to each node, -1 where none lead; True where the sink is reached."""
    source, sink = len(level) - 2, len(level) - 1
    queue = np.empty(len(level), np.int64)
    level[:] = -1
    level[source], queue[0], done, size = 0, source, 0, 1
    while done < size:
        n = queue[done]
        done += 1
        for a in range(graph.first[n], graph.first[n + 1]):
            if graph.left[a] > 0 and level[graph.to[a]] < 0:
                level[graph.to[a]] = level[n] + 1
                queue[size] = graph.to[a]
                size += 1
    return level[sink] >= 0


@njit(cache=True, nogil=True)
def _block(graph: _Residual, level: IntArray) -> None:
    """Push flow along shortest paths until each has a full arc."""
    first, to, back, left = graph
    source, sink = len(level) - 2, len(level) - 1
    following, path = first[:-1].copy(), np.empty(len(level), np.int64)
    depth, n = 0, source
    while True:
        if n == sink:
            depth = _push(graph, path, depth)
            n = to[back[path[depth]]]
            continue
        while following[n] < first[n + 1]:
            a = following[n]
            if left[a] > 0 and level[to[a]] == level[n] + 1:
                break
            following[n] += 1
        if following[n] < first[n + 1]:
            path[depth] = following[n]
            n = to[following[n]]
            depth += 1
        elif n == source:
            return
        else:
            level[n] = -1
            depth -= 1
            n = to[back[path[depth]]]
            following[n] += 1


@njit(cache=True, nogil=True)
def _push(graph: _Residual, path: IntArray, depth: int) -> int:
    """Fill the path's narrowest arc; returns the place of the first arc on the path that is full now."""
    _, _, back, left = graph
    flow = left[path[0]]
    for k in range(1, depth):
        flow = min(flow, left[path[k]])
    cut = depth
    for k in range(depth - 1, -1, -1):
        left[path[k]] -= flow
        left[back[path[k]]] += flow
        if left[path[k]] == 0:
            cut = k
    return cut


@njit(cache=True, nogil=True)
def _not_reaching(graph: _Residual, sink: int) -> BoolArray:
    """Nodes from which the sink can no longer be reached."""
    nodes = len(graph.first) - 1
    out = np.ones(nodes, np.bool_)
    queue = np.empty(nodes, np.int64)
    queue[0], done, size = sink, 0, 1
    out[sink] = False
    while done < size:
        n = queue[done]
        done += 1
        for a in range(graph.first[n], graph.first[n + 1]):
            if out[graph.to[a]] and graph.left[graph.back[a]] > 0:
                out[graph.to[a]] = False
                queue[size] = graph.to[a]
                size += 1
    return out
