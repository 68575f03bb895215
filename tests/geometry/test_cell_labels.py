from __future__ import annotations

import itertools

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.geometry.cell_labels import Borders, label_cells


def energies(cost: FloatArray, borders: Borders, labels: IntArray) -> FloatArray:
    """(N,) of N labellings, (N, cells)."""
    total = cost[np.arange(len(cost)), labels].sum(axis=1)
    for e, (i, j) in enumerate(borders.cells):
        heights = borders.heights[e]
        steps = np.minimum(np.abs(heights[:, :, None] - heights[:, None, :]), borders.step_limit).mean(axis=0)
        p, q = labels[:, i], labels[:, j]
        total += np.where(p != q, borders.change[e] + borders.step[e] * steps[p, q], 0.0)
    found: FloatArray = total
    return found


def energy(cost: FloatArray, borders: Borders, labels: IntArray) -> float:
    return float(energies(cost, borders, labels[None])[0])


def least_energy(cost: FloatArray, borders: Borders) -> float:
    """Of all labellings that there are."""
    cells, planes = cost.shape
    return float(energies(cost, borders, np.array(list(itertools.product(range(planes), repeat=cells)))).min())


def problem(seed: int, cells: int, planes: int, dear: float = 1.0) -> tuple[FloatArray, Borders]:
    """Random costs on a ring of cells with chords; level planes."""
    rng = np.random.default_rng(seed)
    pairs = np.array([(k, (k + by) % cells) for by in (1, 3) for k in range(cells)])
    heights = np.broadcast_to(rng.uniform(0, 1, planes), (len(pairs), 2, planes)).copy()
    cost, length = rng.uniform(0, 2, (cells, planes)), dear * rng.uniform(0, 1.5, len(pairs))
    return cost, Borders(pairs, heights, 0.2 * length, length, 1.0)


@pytest.mark.parametrize("seed", range(8))
def test_two_planes_are_solved_exactly(seed: int) -> None:
    """From one plane on all cells, one expansion of the other is the minimum."""
    cost, borders = problem(seed, 10, 2)
    found = energy(cost, borders, label_cells(cost, borders, try_one_for_all=True))
    best = least_energy(cost, borders)
    assert found == pytest.approx(best, abs=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_several_planes_come_near_the_optimum(seed: int) -> None:
    cost, borders = problem(seed, 7, 4)
    found = energy(cost, borders, label_cells(cost, borders, try_one_for_all=True))
    best = least_energy(cost, borders)
    assert best - 1e-4 <= found <= 1.02 * best


@pytest.mark.parametrize(("planes", "cells", "bound"), [(2, 7, 1.15), (3, 6, 1.2)])
@pytest.mark.parametrize("seed", range(8))
def test_from_the_cheapest_labels_on_it_comes_near_the_optimum(
    seed: int, planes: int, cells: int, bound: float
) -> None:
    """As volumetric models ask, which begin with each cell's own cheapest plane."""
    cost, borders = problem(seed, cells, planes)
    found = energy(cost, borders, label_cells(cost, borders))
    best = least_energy(cost, borders)
    assert best - 1e-4 <= found <= bound * best


@pytest.mark.parametrize("seed", range(8))
def test_no_expansion_makes_the_labels_better(seed: int) -> None:
    cost, borders = problem(seed, 8, 4, 0.5)
    labels = label_cells(cost, borders)
    found = energy(cost, borders, labels)
    takes = np.array(list(itertools.product([False, True], repeat=8)))
    for alpha in range(4):
        assert energies(cost, borders, np.where(takes, alpha, labels)).min() > found - 1e-4


def test_free_borders_leave_every_cell_its_best_plane() -> None:
    cost, borders = problem(0, 12, 5, 0.0)
    assert np.array_equal(label_cells(cost, borders), cost.argmin(axis=1))


def test_dear_borders_leave_one_plane() -> None:
    cost, borders = problem(0, 12, 5, 1e3)
    assert set(label_cells(cost, borders, try_one_for_all=True)) == {int(cost.sum(axis=0).argmin())}


def test_a_tie_keeps_what_is() -> None:
    """A cell without points between two planes costs the same with either."""
    cost = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]])
    borders = Borders(np.array([[0, 1], [1, 2]]), np.zeros((2, 2, 2)), np.array([0.2, 0.2]), np.zeros(2), 0.3)
    assert label_cells(cost, borders).tolist() == [0, 0, 1]


def test_a_plane_out_of_reach_is_never_taken() -> None:
    cost = np.array([[0.5, 1e6], [0.9, 0.0]])
    borders = Borders(np.array([[0, 1]]), np.zeros((1, 2, 2)), np.array([5.0]), np.zeros(1), 0.3)
    assert label_cells(cost, borders).tolist() == [0, 0]


def test_one_plane_or_no_cell() -> None:
    none = Borders(np.empty((0, 2), np.int64), np.empty((0, 2, 1)), np.empty(0), np.empty(0), 0.3)
    assert label_cells(np.ones((3, 1)), none).tolist() == [0, 0, 0]
    assert label_cells(np.ones((0, 4)), none).tolist() == []
