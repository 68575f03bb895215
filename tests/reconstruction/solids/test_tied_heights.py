from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cityflow.reconstruction.solids.tied_heights import TIED, settled

heights = st.lists(st.integers(0, 200).map(lambda k: k / 10_000), min_size=1, max_size=8)


def test_near_heights_meet_in_the_middle_and_floors_stay() -> None:
    assert settled([5.0, 5.002, 7.0]) == {5.0: 5.001, 5.002: 5.001, 7.0: 7.0}
    assert settled([5.0, 5.002], fixed=[5.002]) == {5.0: 5.002, 5.002: 5.002}


@given(heights, st.randoms())
def test_groups_are_narrow_and_apart_in_any_order(values: list[float], random: object) -> None:
    found = settled(values)
    mixed = list(values)
    random.shuffle(mixed)  # type: ignore[attr-defined]
    assert settled(mixed) == found
    assert all(abs(new - old) <= TIED / 2 + 1e-4 for old, new in found.items())
    new = sorted(set(found.values()))
    assert all(b - a > TIED / 2 - 1e-4 for a, b in itertools.pairwise(new))
    assert [found[z] for z in sorted(found)] == sorted(found.values())


@given(heights)
def test_a_lone_floor_never_moves(values: list[float]) -> None:
    assert settled(values, fixed=[values[0]])[values[0]] == pytest.approx(values[0], abs=0)
