from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_flow

from cityflow.core.arrays import IntArray
from cityflow.geometry.min_cut import min_cut


def graph(seed: int, nodes: int, arcs: int, most: int) -> tuple[IntArray, IntArray, IntArray]:
    rng = np.random.default_rng(seed)
    tail, head = rng.integers(0, nodes, (2, arcs))
    keep = tail != head
    return tail[keep], head[keep], rng.integers(0, most, np.count_nonzero(keep))


@pytest.mark.parametrize("seed", range(8))
def test_cut_is_as_small_as_the_flow_is_great(seed: int) -> None:
    nodes = 12
    tail, head, room = graph(seed, nodes, 45, 20)
    side = min_cut(tail, head, room, nodes)
    assert side[nodes - 2]
    assert not side[nodes - 1]
    dense = np.zeros((nodes, nodes), np.int32)
    np.add.at(dense, (tail, head), room)
    flow = maximum_flow(csr_matrix(dense), nodes - 2, nodes - 1).flow_value
    assert room[side[tail] & ~side[head]].sum() == flow


@pytest.mark.parametrize("seed", range(6))
def test_of_cuts_of_one_size_the_largest_side_is_taken(seed: int) -> None:
    """Capacities of 0 to 2 have many minimum cuts; the union of all their sides is one, too."""
    nodes = 9
    tail, head, room = graph(seed, nodes, 24, 3)
    sides = [np.array([*inner, True, False]) for inner in itertools.product([False, True], repeat=nodes - 2)]
    sizes = [room[side[tail] & ~side[head]].sum() for side in sides]
    least = [side for side, size in zip(sides, sizes, strict=True) if size == min(sizes)]
    assert np.array_equal(min_cut(tail, head, room, nodes), np.any(least, axis=0))
