"""Cells of a lattice cut to a tile."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from cityflow.core.ground_cells import GroundCells


def test_cells_of_two_tiles_own_every_point_once() -> None:
    """The lattice of 20 m straddles the seam at 30 m: each tile answers for its part of the cell there."""
    chosen = tuple((c, r) for c in range(-1, 4) for r in range(-1, 3))
    left, right = (GroundCells((x, -10.0, x + 30.0, 40.0), 20.0, chosen) for x in (0.0, 30.0))
    x, y = np.meshgrid(np.arange(0.0, 60.0, 2.5), np.arange(-10.0, 40.0, 2.5))
    owners = left.holds(x, y).astype(int) + right.holds(x, y)
    assert (owners == 1).all()
    assert not left.holds(np.array([60.0, 10.0]), np.array([0.0, 40.0])).any()


def test_a_cell_that_was_not_chosen_holds_nothing() -> None:
    cells = GroundCells((-100.0, -100.0, 100.0, 100.0), 10.0, ((-2, 3), (1, 3), (1, -5)))
    x, y = np.array([-15.0, 5.0, 15.0, 15.0, 15.0]), np.array([35.0, 35.0, 35.0, -45.0, -35.0])
    assert cells.holds(x, y).tolist() == [True, False, True, True, False]
    assert cells.bounds == (-20.0, -50.0, 20.0, 40.0)


def test_the_box_is_cut_to_the_tile() -> None:
    assert GroundCells((5.0, 5.0, 30.0, 12.0), 10.0, ((0, 0), (1, 1))).bounds == (5.0, 5.0, 20.0, 12.0)


def test_without_cells_nothing_is_held_and_there_is_no_box() -> None:
    none = GroundCells((0.0, 0.0, 10.0, 10.0), 10.0, ())
    assert none.holds(np.array([5.0]), np.array([5.0])).tolist() == [False]
    with pytest.raises(ValueError, match="no cell is chosen"):
        _ = none.bounds


def test_far_from_the_origin_of_the_crs_no_more_memory_is_taken() -> None:
    """In UTM a table from the origin on would have 20 billion cells of 10 m."""
    x_0, y_0 = 350000.0, 5800000.0
    cells = GroundCells((x_0, y_0, x_0 + 50.0, y_0 + 50.0), 10.0, tuple((35000 + c, 580000 + r) for c in range(5) for r in range(5) if c != r))  # fmt: skip
    tracemalloc.start()
    found = cells.holds(np.array([x_0 + 12.0, x_0 + 12.0, x_0 + 55.0]), np.array([y_0 + 2.0, y_0 + 12.0, y_0]))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.tolist() == [True, False, False]
    assert peak < 100_000
