"""Gates: each key comes out once, when the last of its events has happened, whatever the order."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cityflow.flow.gates import Gates


@given(
    needs=st.dictionaries(st.integers(0, 20), st.lists(st.integers(0, 8), max_size=5), max_size=12),
    order=st.permutations(range(9)),
    fired_before=st.integers(0, 9),
)
def test_every_key_is_free_exactly_once_and_never_early(
    needs: dict[int, list[int]], order: list[int], fired_before: int
) -> None:
    gates: Gates[int, int] = Gates(set())
    happened: set[int] = set()
    freed: list[int] = []

    def fire(event: int) -> None:
        happened.add(event)
        for key in gates.fire(event):
            assert set(needs[key]) <= happened
            freed.append(key)

    for event in order[:fired_before]:
        fire(event)
    for key, events in needs.items():
        ready = gates.wait(key, events)
        assert ready == (set(events) <= happened)
        if ready:
            freed.append(key)
    for event in order[fired_before:]:
        fire(event)
    assert sorted(freed) == sorted(needs)
    assert gates.waiting() == ()
