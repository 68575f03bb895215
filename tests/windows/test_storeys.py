from __future__ import annotations

import numpy as np
import pytest

from cityflow.windows.storeys import door_like, storeys_of
from drawn_walls import wall

WINDOWS = [(20, 30, 34, 50), (60, 30, 74, 50), (100, 30, 114, 50)]
"""A row whose sills are at row 50; cells of 0.06 m."""


def doors(*boxes: tuple[int, int, int, int]) -> list[bool]:
    found = door_like(np.array([*WINDOWS, *boxes], float), wall())[len(WINDOWS) :]
    return [bool(d) for d in found]


@pytest.mark.parametrize(
    ("box", "door"),
    [
        ((130, 32, 147, 66), True), ((130, 32, 147, 61), False), ((130, 32, 160, 66), False), ((130, 20, 147, 55), False), ((130, 52, 147, 90), False),
    ],
)  # fmt: skip
def test_a_door_is_tall_and_stands_lower_than_the_windows_beside_it(box: tuple[int, int, int, int], door: bool) -> None:
    """2 m high; 1.7 m; as wide as high; with its sill hardly lower; below the row."""
    assert doors(box) == [door]


def test_above_other_windows_nothing_is_a_door() -> None:
    assert doors((130, 32, 147, 66), (20, 75, 34, 95)) == [False, False]


def test_a_tall_box_alone_tells_nothing_and_no_box_neither() -> None:
    assert door_like(np.array([(130.0, 32, 147, 66)]), wall()).tolist() == [False]
    assert door_like(np.empty((0, 4)), wall()).tolist() == []


def test_windows_are_never_doors() -> None:
    assert door_like(np.array(WINDOWS, float), wall()).tolist() == [False] * 3


@pytest.mark.parametrize("shift", [0.0, 57.3, -20.0])
def test_storeys_do_not_depend_on_where_the_wall_stands_or_on_the_order(shift: float) -> None:
    """Three rows of windows 2.9 m apart, with 5 cm of scatter."""
    rng = np.random.default_rng(1)
    sills = shift + 1.0 + 2.9 * np.repeat(np.arange(3), 4) + rng.normal(0, 0.05, 12)
    for order in (np.arange(12), rng.permutation(12)):
        assert storeys_of([(0.0, s, 1.0, s + 1.3) for s in sills[order]], shift) == 3


def test_a_row_that_shows_none_is_counted_between_and_below() -> None:
    """Rows at 1.0 and 3.9 and 9.7: one of 6.8 is missing; with the foot 2.9 m lower, one below as well."""
    bounds = [(0.0, s, 1.0, s + 1.3) for s in (1.0, 3.9, 9.7)]
    assert storeys_of(bounds, 0.0) == 4
    assert storeys_of(bounds, -2.9) == 5
