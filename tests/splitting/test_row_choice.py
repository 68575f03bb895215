"""The sum over all sequences of borders, against one that goes through them one by one."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.row_choice import ANY, Row, choose

S, WIDEST = 7, 12


def factors(seed: int = 3) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    widths = rng.uniform(0.2, 2.0, (2, WIDEST))
    widths[:, 1] = 0.0
    return widths, np.array([1.0, 0.4])


def one_by_one(row: Row, widths: FloatArray, weights: FloatArray) -> tuple[float, FloatArray]:
    """Sum and probability of a border at each station."""
    total, border = 0.0, np.zeros(S)
    for count in range(S + 1):
        for at in combinations(range(S), count):
            if row.groups and [row.group[k] for k in at] != list(range(row.groups)):
                continue
            for m, weight in enumerate(weights):
                first = widths[m, 0 if row.first < 0 else at[0] + row.first] if at else 1.0
                last = widths[m, 0 if row.last < 0 else S - 1 - at[-1] + row.last] if at else 1.0
                inner = np.prod([widths[m, b - a] for a, b in pairwise(at)])
                whole = widths[m, 0 if min(row.first, row.last) < 0 else S - 1 + row.first + row.last]
                value = weight * np.exp(row.odds[list(at)].sum()) * (first * inner * last if at else whole)
                total += value
                border[list(at)] += value
    return total, border / total


@pytest.mark.parametrize(("first", "last"), [(1, 2), (-1, 2), (1, -1), (-1, -1)])
def test_probabilities_are_those_of_all_sequences(first: int, last: int) -> None:
    row = Row(np.random.default_rng(5).normal(0, 1, S), first, last, np.full(S, ANY), 0)
    total, border = one_by_one(row, *factors())
    found = choose(row, *factors())
    assert found.log_sum == pytest.approx(np.log(total))
    np.testing.assert_allclose(found.border, border)
    assert found.modes.sum() == pytest.approx(1.0)
    assert found.units.sum() == pytest.approx(1.0 + border.sum()), "one unit more than borders"


def test_known_borders_allow_only_sequences_with_them() -> None:
    row = Row(np.random.default_rng(6).normal(0, 1, S), 0, 0, np.array([-2, 0, 0, -2, 1, 1, -2]), 2)
    total, border = one_by_one(row, *factors())
    found = choose(row, *factors())
    assert found.log_sum == pytest.approx(np.log(total))
    np.testing.assert_allclose(found.border, border)
    assert found.border[1:3].sum() == pytest.approx(1.0)


def test_a_row_that_is_known_to_be_one_unit() -> None:
    found = choose(Row(np.zeros(S), 0, 0, np.full(S, -2), 0), *factors())
    assert not found.border.any()
    assert found.units.sum() == pytest.approx(1.0)
