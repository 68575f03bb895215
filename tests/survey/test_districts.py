"""Districts: squares of a fixed lattice, each part in one of them, none of more than 64 parts."""

from __future__ import annotations

import pytest

from cityflow.core.grid import Tile
from cityflow.survey.districts import CITY, MOST, districts_of


def square(col: int, row: int, side: int) -> list[Tile]:
    return [Tile(col + i, row + j, 250.0) for j in range(side) for i in range(side)]


@pytest.mark.parametrize("side", [1, 5, 8, 9, 20, 70])
def test_every_tile_comes_to_the_city_once_and_no_merge_is_large(side: int) -> None:
    tiles = square(-3, 1789, side)
    found = districts_of(tiles, [t.name for t in tiles])
    reached, names = [], [CITY]
    while names:
        name = names.pop()
        parts = found.parts.get(name)
        if parts is None:
            reached.append(name)
        else:
            assert 0 < len(parts) <= MOST
            assert all(found.parent[part] == name for part in parts)
            names.extend(parts)
    assert sorted(reached) == sorted(t.name for t in tiles)
    assert (found.names == []) == (side <= 8)


def test_a_larger_survey_and_an_area_leave_districts_as_they_are() -> None:
    small, large = square(0, 0, 10), square(-8, -8, 30)
    before = districts_of(small, [t.name for t in small])
    after = districts_of(large, [t.name for t in large])
    assert after.parts["8x8_0_0"] == before.parts["8x8_0_0"]
    inside = districts_of(large, ["3_3", "9_3"])
    assert inside.parts == {"8x8_0_0": ("3_3",), "8x8_1_0": ("9_3",), CITY: ("8x8_0_0", "8x8_1_0")}
