from __future__ import annotations

import numpy as np
import pytest

from cityflow.windows.candidates import Candidates
from cityflow.windows.choice import chosen, support_of
from drawn_walls import rows_of


def made(boxes: list[tuple[int, int, int, int]] | np.ndarray, sound: list[float] | float = 1.0, channel: int = 0) -> Candidates:  # fmt: skip
    """All sides as complete as `sound` says."""
    at = np.asarray(boxes, np.int64).reshape(-1, 4)
    n = len(at)
    sides = np.tile(np.broadcast_to(np.asarray(sound, float), (n,))[:, None], (1, 4))
    return Candidates(at, sides, np.ones((n, 4)), np.ones(n), np.ones(n), np.full(n, channel), at.copy())


def kept(found: Candidates, bonus: list[float] | None = None) -> list[list[int]]:
    return [b.tolist() for b in chosen(found, np.zeros(len(found)) if bonus is None else np.array(bonus), 2.0)[0].boxes]


def test_of_boxes_that_are_the_same_the_sounder_stays() -> None:
    found = made([(10, 10, 24, 30), (10, 10, 25, 30), (60, 10, 74, 30)], [0.8, 0.9, 0.7])
    assert kept(found) == [[10, 10, 25, 30], [60, 10, 74, 30]]
    assert kept(found, [0.3, 0.0, 0.0]) == [[10, 10, 24, 30], [60, 10, 74, 30]]


def test_of_equal_ones_the_first_stays() -> None:
    assert kept(made([(10, 10, 24, 30), (11, 10, 25, 30)])) == [[10, 10, 24, 30]]


def test_boxes_apart_all_stay_in_their_order_whatever_the_order_was() -> None:
    boxes = rows_of(3, 4)
    assert kept(made(boxes)) == boxes.tolist()
    assert sorted(kept(made(boxes[::-1]))) == sorted(boxes.tolist())


def test_support_decides_between_a_window_and_what_overlaps_it() -> None:
    """A box over half of a window and the wall beside it, as sound, but of no row."""
    boxes = [[22, 12, 40, 30], *rows_of(1, 4).tolist()]
    assert kept(made(boxes)) == rows_of(1, 4).tolist()
    assert kept(made(boxes, [1.0, 0.6, 1.0, 1.0, 1.0]))[0] == [22, 12, 40, 30]


def test_what_a_box_keeps_free_counts_not_only_itself() -> None:
    """Between open shutters: nothing may stand where the wings are."""
    found = made([(20, 10, 30, 30), (31, 10, 36, 30)], [1.0, 0.9])
    assert len(kept(found)) == 2
    found.around[0] = (14, 10, 36, 30)
    assert kept(found) == [[20, 10, 30, 30]]


def test_support_is_counted_in_rows_and_columns_of_the_same_channel() -> None:
    """Of 3 by 4 windows each has three in its row and two in its column."""
    found = made(rows_of(3, 4))
    assert support_of(found, 2.0).tolist() == [5] * 12
    other = made(rows_of(3, 4)[:1] + np.array([140, 0, 140, 0]), channel=1)
    assert support_of(Candidates.joined([found, other]), 2.0).tolist() == [5] * 12 + [0]


@pytest.mark.parametrize("n", [0, 1])
def test_none_and_one(n: int) -> None:
    found, support = chosen(made(rows_of(1, 1)[:n]), np.zeros(n), 2.0)
    assert len(found) == n
    assert support.tolist() == [0] * n
