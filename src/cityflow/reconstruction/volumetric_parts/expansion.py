"""Surfaces on columns by expansion moves, each one exact minimum cut over the columns that can take the surface.

The energy is a cost per column and surface, and per edge between columns with different surfaces a constant plus the
truncated height step: a metric, so that each move is a cut (Boykov, Veksler, Zabih 2001). Costs are whole numbers, so that
the result is the same on every machine.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

SCALE = 1e6
"""Costs are counted in whole millionths."""
SWEEPS = 10
OUT_OF_REACH = 1e5
"""A surface that costs more than this on a column never tops it."""


def label_columns(
    cost: FloatArray, pairs: IntArray, heights: FloatArray, weights: FloatArray, step_limit: float
) -> IntArray:
    """Surface of each column.

    Parameters
    ----------
    cost : (C, P) cost of each surface on each column
    pairs : (E, 2) int64, columns on both sides of an edge
    heights : (E, 2, P) heights of the surfaces at both ends of each edge, metres
    weights : (E, 2) cost of a change of surface, and of a metre of step, along each edge
    step_limit : metres, higher steps cost no more

    Returns
    -------
    (C,) int64
    """
    if cost.shape[1] < 2 or len(cost) == 0:
        return np.zeros(len(cost), np.int64)
    unary = np.round(cost * SCALE).astype(np.int64)
    first, edges = _edges_of(pairs, len(cost))
    graph = pairs, heights, weights * SCALE, step_limit
    return _expand(unary, *graph, first, edges, np.argmin(unary, axis=1).astype(np.int64))


@njit(cache=True, nogil=True)
def _edges_of(pairs: IntArray, columns: int) -> tuple[IntArray, IntArray]:
    first = np.zeros(columns + 1, np.int64)
    for e in range(len(pairs)):
        first[pairs[e, 0] + 1] += 1
        first[pairs[e, 1] + 1] += 1
    first = np.cumsum(first)
    place = first[:-1].copy()
    edges = np.empty(2 * len(pairs), np.int64)
    for e in range(len(pairs)):
        for c in (pairs[e, 0], pairs[e, 1]):
            edges[place[c]] = e
            place[c] += 1
    return first, edges


@njit(cache=True, nogil=True)
def _edge_cost(heights: FloatArray, weights: FloatArray, limit: float, e: int, p: int, q: int) -> int:
    if p == q:
        return 0
    step = min(abs(heights[e, 0, p] - heights[e, 0, q]), limit) + min(abs(heights[e, 1, p] - heights[e, 1, q]), limit)
    return int(weights[e, 0] + weights[e, 1] * step / 2 + 0.5)


@njit(cache=True, nogil=True)
def _expand(
    unary: IntArray, pairs: IntArray, heights: FloatArray, weights: FloatArray, limit: float,
    first: IntArray, edges: IntArray, labels: IntArray,
) -> IntArray:  # fmt: skip
    columns, surfaces = unary.shape
    node = np.full(columns, -1, np.int64)
    stale = np.ones(surfaces, np.bool_)
    for _ in range(SWEEPS):
        changed = False
        for alpha in range(surfaces):
            if not stale[alpha]:
                continue
            takes = _move(unary, pairs, heights, weights, limit, first, edges, labels, alpha, node)
            moved = False
            for c in range(columns):
                if takes[c] and labels[c] != alpha:
                    labels[c] = alpha
                    moved = True
            stale[alpha] = False
            if moved:
                changed = True
                stale[:] = True
                stale[alpha] = False
        if not changed:
            break
    return labels


@njit(cache=True, nogil=True)
def _move(
    unary: IntArray, pairs: IntArray, heights: FloatArray, weights: FloatArray, limit: float,
    first: IntArray, edges: IntArray, labels: IntArray, alpha: int, node: IntArray,
) -> BoolArray:  # fmt: skip
    """Columns that take a surface in the best expansion; ties keep what is."""
    takes = np.zeros(len(labels), np.bool_)
    chosen = np.empty(len(labels), np.int64)
    size = 0
    for c in range(len(labels)):
        node[c] = -1
        if labels[c] != alpha and unary[c, alpha] < OUT_OF_REACH * SCALE:
            node[c] = size
            chosen[size] = c
            size += 1
    if size == 0:
        return takes
    gain = np.zeros(size, np.int64)
    most = 0
    for k in range(size):
        most += first[chosen[k] + 1] - first[chosen[k]]
    tail, head = np.empty(size + most, np.int64), np.empty(size + most, np.int64)
    room = np.empty(size + most, np.int64)
    arcs = 0
    for k in range(size):
        c = chosen[k]
        gain[k] += unary[c, alpha] - unary[c, labels[c]]
        for a in range(first[c], first[c + 1]):
            e = edges[a]
            i, j = pairs[e, 0], pairs[e, 1]
            other = j if i == c else i
            now = _edge_cost(heights, weights, limit, e, labels[c], labels[other])
            if node[other] < 0:
                gain[k] += _edge_cost(heights, weights, limit, e, alpha, labels[other]) - now
            elif i == c:
                keep_take = _edge_cost(heights, weights, limit, e, labels[c], alpha)
                take_keep = _edge_cost(heights, weights, limit, e, alpha, labels[other])
                gain[k] += take_keep - now
                gain[node[other]] -= take_keep
                tail[arcs], head[arcs] = node[i], node[j]
                room[arcs] = max(keep_take + take_keep - now, 0)
                arcs += 1
    # Source side keeps its surface: a cost of taking hangs on the source, a gain on the sink.
    source, sink = size, size + 1
    for k in range(size):
        if gain[k] > 0:
            tail[arcs], head[arcs], room[arcs] = source, k, gain[k]
            arcs += 1
        elif gain[k] < 0:
            tail[arcs], head[arcs], room[arcs] = k, sink, -gain[k]
            arcs += 1
    keeps = min_cut(tail[:arcs], head[:arcs], room[:arcs], size + 2)
    for k in range(size):
        takes[chosen[k]] = not keeps[k]
    return takes


@njit(cache=True, nogil=True)
def min_cut(tail: IntArray, head: IntArray, room: IntArray, nodes: int) -> BoolArray:
    """Nodes on the source's side of a minimum cut: the largest such side. Source and sink are the last two nodes.

    Dinic's algorithm: blocking flows in layers of equal distance from the source.

    Parameters
    ----------
    tail, head, room : (A,) int64, arcs and their capacities
    nodes : number of nodes, source and sink included
    """
    source, sink = nodes - 2, nodes - 1
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
    level, queue = np.empty(nodes, np.int64), np.empty(nodes, np.int64)
    path = np.empty(nodes, np.int64)
    while True:
        level[:] = -1
        level[source], queue[0], done, size = 0, source, 0, 1
        while done < size:
            n = queue[done]
            done += 1
            for a in range(first[n], first[n + 1]):
                if left[a] > 0 and level[to[a]] < 0:
                    level[to[a]] = level[n] + 1
                    queue[size] = to[a]
                    size += 1
        if level[sink] < 0:
            break
        following = first[:-1].copy()
        depth, n = 0, source
        while True:
            if n == sink:
                flow = left[path[0]]
                for k in range(1, depth):
                    flow = min(flow, left[path[k]])
                cut = depth
                for k in range(depth - 1, -1, -1):
                    left[path[k]] -= flow
                    left[back[path[k]]] += flow
                    if left[path[k]] == 0:
                        cut = k
                depth = cut
                n = to[back[path[cut]]]
                continue
            advanced = False
            while following[n] < first[n + 1]:
                a = following[n]
                if left[a] > 0 and level[to[a]] == level[n] + 1:
                    path[depth] = a
                    depth += 1
                    n = to[a]
                    advanced = True
                    break
                following[n] += 1
            if advanced:
                continue
            if n == source:
                break
            level[n] = -1
            depth -= 1
            n = to[back[path[depth]]]
            following[n] += 1
    return _not_reaching(first, to, back, left, sink)


@njit(cache=True, nogil=True)
def _not_reaching(first: IntArray, to: IntArray, back: IntArray, left: IntArray, sink: int) -> BoolArray:
    """Nodes from which the sink can no longer be reached."""
    nodes = len(first) - 1
    out = np.ones(nodes, np.bool_)
    queue = np.empty(nodes, np.int64)
    queue[0], done, size = sink, 0, 1
    out[sink] = False
    while done < size:
        n = queue[done]
        done += 1
        for a in range(first[n], first[n + 1]):
            if out[to[a]] and left[back[a]] > 0:
                out[to[a]] = False
                queue[size] = to[a]
                size += 1
    return out
