"""Labels of cells by energy minimisation: alpha-expansion over exact minimum cuts of small graphs.

The energy is the sum of a cost per cell and label and, for each pair of neighbouring cells with different labels, a
cost that is a metric over the labels; each expansion move is then one minimum cut (Boykov, Veksler, Zabih 2001).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cityflow.core.arrays import FloatArray, IntArray

SCALE = 1e6
"""Costs are counted in whole millionths, so that cuts are exact and the same on every machine."""

MAX_SWEEPS = 12


def label_cells(cost: FloatArray, pairs: IntArray, pair_cost: FloatArray) -> IntArray:
    """Label of each cell.

    Parameters
    ----------
    cost : (C, P) cost of each label in each cell
    pairs : (E, 2) int64, neighbouring cells
    pair_cost : (E, P, P) cost of each pair of labels, a metric over labels for every pair of cells
    """
    if cost.shape[1] < 2 or len(cost) == 0:
        return np.zeros(len(cost), dtype=np.int64)
    unary = np.round(cost * SCALE).astype(np.int64)
    pairwise = np.round(pair_cost * SCALE).astype(np.int64)
    best = _expand(unary, pairs, pairwise, np.argmin(unary, axis=1).astype(np.int64))
    # One common label for all is a second start: expansion from it finds what a noisy start hides.
    common = np.full(len(cost), int(np.argmin(unary.sum(axis=0))), dtype=np.int64)
    other = _expand(unary, pairs, pairwise, common)
    return other if _energy(unary, pairs, pairwise, other) < _energy(unary, pairs, pairwise, best) else best


@njit(cache=True, nogil=True)
def _energy(unary: IntArray, pairs: IntArray, pairwise: IntArray, labels: IntArray) -> int:
    total = 0
    for c in range(len(labels)):
        total += unary[c, labels[c]]
    for e in range(len(pairs)):
        total += pairwise[e, labels[pairs[e, 0]], labels[pairs[e, 1]]]
    return total


@njit(cache=True, nogil=True)
def _expand(unary: IntArray, pairs: IntArray, pairwise: IntArray, labels: IntArray) -> IntArray:
    energy = _energy(unary, pairs, pairwise, labels)
    for _ in range(MAX_SWEEPS):
        before = energy
        for alpha in range(unary.shape[1]):
            takes = _expansion(unary, pairs, pairwise, labels, alpha)
            moved = labels.copy()
            for c in range(len(labels)):
                if takes[c]:
                    moved[c] = alpha
            moved_energy = _energy(unary, pairs, pairwise, moved)
            if moved_energy < energy:
                labels, energy = moved, moved_energy
        if energy == before:
            break
    return labels


@njit(cache=True, nogil=True)
def _expansion(unary: IntArray, pairs: IntArray, pairwise: IntArray, labels: IntArray, alpha: int) -> IntArray:
    """1 where a cell takes alpha in the best expansion move, else 0."""
    cells = len(labels)
    arcs = cells + len(pairs)
    tail, head = np.empty(arcs, np.int64), np.empty(arcs, np.int64)
    forth, back = np.zeros(arcs, np.int64), np.zeros(arcs, np.int64)
    takes_cost = np.zeros(cells, np.int64)
    for c in range(cells):
        takes_cost[c] = unary[c, alpha] - unary[c, labels[c]]
    for e in range(len(pairs)):
        i, j = pairs[e, 0], pairs[e, 1]
        keep_keep, keep_take = pairwise[e, labels[i], labels[j]], pairwise[e, labels[i], alpha]
        take_keep = pairwise[e, alpha, labels[j]]
        takes_cost[i] += take_keep - keep_keep
        takes_cost[j] -= take_keep
        tail[cells + e], head[cells + e] = i, j
        forth[cells + e] = max(keep_take + take_keep - keep_keep, 0)
    source, sink = cells, cells + 1
    for c in range(cells):
        if takes_cost[c] >= 0:
            tail[c], head[c], forth[c] = source, c, takes_cost[c]
        else:
            tail[c], head[c], forth[c] = c, sink, -takes_cost[c]
    on_source_side = _min_cut(tail, head, forth, back, cells + 2)
    return 1 - on_source_side[:cells]


@njit(cache=True, nogil=True)
def _min_cut(tail: IntArray, head: IntArray, forth: IntArray, back: IntArray, nodes: int) -> IntArray:
    """1 for nodes on the source's side of a minimum cut; source and sink are the last two nodes.

    Shortest augmenting paths (Edmonds and Karp); graphs have a few hundred nodes at most.
    """
    source, sink = nodes - 2, nodes - 1
    first, arcs = _incidence(tail, head, nodes)
    while True:
        came = np.full(nodes, -1, np.int64)
        queue = np.empty(nodes, np.int64)
        queue[0], done, size = source, 0, 1
        came[source] = -2
        while done < size and came[sink] == -1:
            node = queue[done]
            done += 1
            for k in range(first[node], first[node + 1]):
                a = arcs[k]
                other = head[a] if tail[a] == node else tail[a]
                room = forth[a] if tail[a] == node else back[a]
                if room > 0 and came[other] == -1:
                    came[other] = a
                    queue[size] = other
                    size += 1
        if came[sink] == -1:
            return (came != -1).astype(np.int64)
        _augment(tail, head, forth, back, came, source, sink)


@njit(cache=True, nogil=True)
def _incidence(tail: IntArray, head: IntArray, nodes: int) -> tuple[IntArray, IntArray]:
    first = np.zeros(nodes + 1, np.int64)
    for a in range(len(tail)):
        first[tail[a] + 1] += 1
        first[head[a] + 1] += 1
    first = np.cumsum(first)
    place = first[:-1].copy()
    arcs = np.empty(2 * len(tail), np.int64)
    for a in range(len(tail)):
        for node in (tail[a], head[a]):
            arcs[place[node]] = a
            place[node] += 1
    return first, arcs


@njit(cache=True, nogil=True)
def _augment(
    tail: IntArray, head: IntArray, forth: IntArray, back: IntArray, came: IntArray, source: int, sink: int
) -> None:
    room, node = np.int64(2**62), sink
    while node != source:
        a = came[node]
        room = min(room, forth[a] if head[a] == node else back[a])
        node = tail[a] if head[a] == node else head[a]
    node = sink
    while node != source:
        a = came[node]
        if head[a] == node:
            forth[a] -= room
            back[a] += room
            node = tail[a]
        else:
            back[a] -= room
            forth[a] += room
            node = head[a]
