"""One function over many values, here and on a cluster."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cityflow.flow.spread import Spread
from flow.toy_values import BAD, DEADLY, MISSING, half_of


def told(spread: Spread, values: list[int]) -> list[object]:
    found = dict(spread.map(half_of, values))
    assert sorted(found) == list(range(len(values)))
    return [str(found[k]) if isinstance(found[k], Exception) else found[k] for k in range(len(values))]


def test_errors_are_answers_and_others_go_on() -> None:
    assert told(Spread(), [4, BAD, 8, MISSING, 10]) == [2, "5: odd", 4, "7", 5]


def test_values_are_taken_as_they_are_needed() -> None:
    asked: list[int] = []

    def values() -> Iterator[int]:
        for k in range(1000):
            asked.append(k)
            yield k

    answers = Spread().map(half_of, values())
    assert next(answers) == (0, 0)
    assert asked == [0]


@pytest.mark.cluster
def test_on_a_cluster_the_one_that_kills_its_worker_is_named() -> None:
    values = [4, BAD, DEADLY, 8, MISSING, *range(20, 80, 2)]
    pages: list[str] = []
    with Spread(workers=2, started=pages.append) as spread:
        found = told(spread, values)
        with pytest.raises(ZeroDivisionError):
            list(spread.map((1).__floordiv__, [1, 0]))
        assert told(spread, [2, 4]) == [1, 2]
    assert len(pages) == 1
    assert pages[0].startswith("http")
    alone = "the worker that had it died → see the log of the workers; it may need more memory"
    assert found == [2, "5: odd", alone, 4, "7", *range(10, 40)]
