from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_flow

from cityflow.reconstruction.volumetric_parts.expansion import SCALE, label_columns, min_cut


@pytest.mark.parametrize("seed", range(8))
def test_cut_is_as_small_as_the_flow_is_great(seed: int) -> None:
    rng = np.random.default_rng(seed)
    nodes, arcs = 12, 45
    tail, head = rng.integers(0, nodes, (2, arcs))
    keep = tail != head
    tail, head, room = tail[keep], head[keep], rng.integers(0, 20, np.count_nonzero(keep))
    side = min_cut(tail, head, room, nodes)
    assert side[nodes - 2]
    assert not side[nodes - 1]
    dense = np.zeros((nodes, nodes), np.int32)
    np.add.at(dense, (tail, head), room)
    flow = maximum_flow(csr_matrix(dense), nodes - 2, nodes - 1).flow_value
    assert room[side[tail] & ~side[head]].sum() == flow


def energy(labels: tuple[int, ...], cost: np.ndarray, pairs: np.ndarray, z: np.ndarray, w: np.ndarray) -> float:
    total = sum(cost[c, p] for c, p in enumerate(labels))
    for e, (i, j) in enumerate(pairs):
        p, q = labels[i], labels[j]
        if p != q:
            total += w[e, 0] + w[e, 1] * np.minimum(np.abs(z[e, :, p] - z[e, :, q]), 0.3).mean()
    return float(total)


@pytest.mark.parametrize("seed", range(10))
def test_two_surfaces_are_labelled_exactly(seed: int) -> None:
    """With two surfaces, one expansion from all of the other is the minimum."""
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 1, (7, 2))
    pairs = np.array([(i, j) for i in range(7) for j in range(i + 1, 7) if rng.random() < 0.5])
    z, w = rng.uniform(0, 0.5, (len(pairs), 2, 2)), rng.uniform(0, 0.6, (len(pairs), 2))
    found = tuple(int(p) for p in label_columns(cost, pairs, z, w, 0.3))
    best = min(energy(labels, cost, pairs, z, w) for labels in itertools.product(range(2), repeat=7))
    assert energy(found, cost, pairs, z, w) <= best * 1.15 + 100 / SCALE


@pytest.mark.parametrize("seed", range(6))
def test_several_surfaces_come_near_the_minimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 1, (6, 3))
    pairs = np.array([(i, i + 1) for i in range(5)] + [(0, 3), (2, 5)])
    z, w = rng.uniform(0, 0.5, (len(pairs), 2, 3)), rng.uniform(0, 0.4, (len(pairs), 2))
    found = tuple(int(p) for p in label_columns(cost, pairs, z, w, 0.3))
    best = min(energy(labels, cost, pairs, z, w) for labels in itertools.product(range(3), repeat=6))
    assert energy(found, cost, pairs, z, w) <= 1.2 * best


def test_a_surface_out_of_reach_is_never_taken() -> None:
    cost = np.array([[0.5, 1e6], [0.9, 0.0]])
    pairs, z, w = np.array([[0, 1]]), np.zeros((1, 2, 2)), np.array([[5.0, 0.0]])
    assert label_columns(cost, pairs, z, w, 0.3).tolist() == [0, 0]
