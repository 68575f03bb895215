"""Overhangs against the truth: what is stated, what is right, what is invented."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import LineString

from cityflow.core.building import EdgeOverhang
from cityflow.evaluation.models_overhangs import overhang_errors, shares_within

WALLS = shapely.box(0, 0, 8, 6)
ROOF = shapely.box(0, -0.5, 8, 6.5)
"""Eaves of 0.5 m in the south and in the north, none at the gables."""


def south(first: float, last: float, reach: float) -> EdgeOverhang:
    return EdgeOverhang(LineString([(first, 0.3), (last, 0.3)]), reach, 0.05, 1.0)


def test_an_edge_that_states_nothing_has_none() -> None:
    errors = overhang_errors(WALLS, ROOF, [south(0, 8, 0.55), EdgeOverhang(LineString([(8, 6), (0, 6)]), 0.0)])
    assert sorted(errors.found_m) == pytest.approx([0.0, 0.55])
    assert sorted(errors.stated) == [False, True]
    shares = shares_within([errors], 0.16)
    assert (shares.stated, shares.within, shares.stated_within) == (0.5, 0.5, 1.0)


@pytest.mark.parametrize(("length", "found"), [(3.0, 0.0), (5.0, 0.5)])
def test_half_of_an_edge_has_to_be_stated(length: float, found: float) -> None:
    errors = overhang_errors(WALLS, ROOF, [south(0, length, 0.5)])
    assert errors.found_m.max() == pytest.approx(found)


def test_less_is_invented() -> None:
    bare = overhang_errors(WALLS, WALLS, [south(0, 3, 0.3)])
    assert bare.invented == 1
    assert overhang_errors(WALLS, WALLS, [south(0, 0.4, 0.3)]).invented == 0


def test_nothing_to_count() -> None:
    assert np.isnan(shares_within([], 0.16).within)
