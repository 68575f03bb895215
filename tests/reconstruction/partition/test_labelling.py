from __future__ import annotations

import itertools

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.partition.labelling import label_cells


def energy(cost: FloatArray, pairs: IntArray, pair_cost: FloatArray, labels: IntArray) -> float:
    unary = cost[np.arange(len(cost)), labels].sum()
    return float(unary + sum(pair_cost[e, labels[i], labels[j]] for e, (i, j) in enumerate(pairs)))


def problem(seed: int, cells: int, planes: int) -> tuple[FloatArray, IntArray, FloatArray]:
    """Random costs on a ring of cells with chords; pair costs are lengths times distances of heights: a metric."""
    rng = np.random.default_rng(seed)
    pairs = np.array([(k, (k + 1) % cells) for k in range(cells)] + [(k, (k + 3) % cells) for k in range(cells)])
    heights = rng.uniform(0, 1, planes)
    metric = 0.2 * (1 - np.eye(planes)) + np.abs(heights[:, None] - heights)
    return rng.uniform(0, 2, (cells, planes)), pairs, rng.uniform(0, 1.5, len(pairs))[:, None, None] * metric


@pytest.mark.parametrize("seed", range(8))
def test_two_labels_are_solved_exactly(seed: int) -> None:
    cost, pairs, pair_cost = problem(seed, 10, 2)
    found = energy(cost, pairs, pair_cost, label_cells(cost, pairs, pair_cost))
    best = min(energy(cost, pairs, pair_cost, np.array(labels)) for labels in itertools.product(range(2), repeat=10))
    assert found == pytest.approx(best, abs=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_several_labels_come_near_the_optimum(seed: int) -> None:
    cost, pairs, pair_cost = problem(seed, 7, 4)
    found = energy(cost, pairs, pair_cost, label_cells(cost, pairs, pair_cost))
    best = min(energy(cost, pairs, pair_cost, np.array(labels)) for labels in itertools.product(range(4), repeat=7))
    assert best - 1e-4 <= found <= 1.02 * best


def test_free_edges_leave_every_cell_its_best_label() -> None:
    cost, pairs, pair_cost = problem(0, 12, 5)
    assert np.array_equal(label_cells(cost, pairs, 0 * pair_cost), cost.argmin(axis=1))


def test_dear_edges_leave_one_label() -> None:
    cost, pairs, pair_cost = problem(0, 12, 5)
    assert set(label_cells(cost, pairs, 1e3 * pair_cost)) == {int(cost.sum(axis=0).argmin())}


def test_one_label_or_no_cell() -> None:
    none = np.empty((0, 2), np.int64)
    assert label_cells(np.ones((3, 1)), none, np.empty((0, 1, 1))).tolist() == [0, 0, 0]
    assert label_cells(np.ones((0, 4)), none, np.empty((0, 4, 4))).tolist() == []
