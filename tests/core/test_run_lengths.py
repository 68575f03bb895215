from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cityflow.core.run_lengths import RunLengthMask

PAIRS = st.tuples(st.integers(1, 8), st.integers(1, 9)).flatmap(
    lambda shape: st.tuples(arrays(bool, shape), arrays(bool, shape))
)


@given(PAIRS)
def test_a_mask_comes_back_and_counts_are_those_of_cells(masks: tuple[np.ndarray, np.ndarray]) -> None:
    one, other = masks
    a, b = RunLengthMask.of(one), RunLengthMask.of(other)
    np.testing.assert_array_equal(a.mask(), one)
    assert a.count == one.sum()
    assert a.overlap(b) == b.overlap(a) == (one & other).sum()
    assert a.overlap(a) == a.count


@pytest.mark.parametrize("value", [False, True])
@pytest.mark.parametrize("shape", [(1, 1), (3, 4), (0, 4), (4, 0)])
def test_masks_of_one_value_or_of_no_cell(shape: tuple[int, int], value: bool) -> None:
    made = RunLengthMask.of(np.full(shape, value))
    assert made.mask().shape == shape
    assert (made.mask() == value).all()
    assert made.count == made.overlap(made) == value * shape[0] * shape[1]


def test_runs_go_on_from_row_to_row() -> None:
    """Cells 2, 3 and 4 of a raster of three columns, and the last one."""
    mask = np.zeros((3, 3), bool)
    mask.ravel()[[2, 3, 4, 8]] = True
    assert RunLengthMask.of(mask).ends.tolist() == [2, 5, 8, 9]


def test_little_is_kept_of_a_large_mask() -> None:
    """A square of 300 rows in a raster of a million cells: two numbers a row."""
    mask = np.zeros((1000, 1000), bool)
    mask[100:400, 200:500] = True
    made = RunLengthMask.of(mask)
    assert made.ends.size <= 2 * 300 + 1
    assert made.count == 90_000


def test_a_view_of_other_rows_is_taken_as_it_looks() -> None:
    mask = np.random.default_rng(1).random((6, 8)) < 0.5
    np.testing.assert_array_equal(RunLengthMask.of(mask[::-1, ::2].T).mask(), mask[::-1, ::2].T)
