from __future__ import annotations

import numpy as np
import pytest

from cityflow.windows.rows import aligned, in_column, in_row, overlap, places
from cityflow.windows.storeys import storeys_of


def grid_of(rows: int, columns: int, pitch: tuple[int, int] = (30, 40), size: tuple[int, int] = (12, 18)) -> np.ndarray:
    left, top = np.meshgrid(10 + pitch[0] * np.arange(columns), 8 + pitch[1] * np.arange(rows))
    corner = np.stack([left.ravel(), top.ravel()], axis=1)
    return np.concatenate([corner, corner + size], axis=1)


def test_rows_and_columns_are_those_of_a_grid() -> None:
    boxes = grid_of(3, 4)
    assert in_row(boxes, boxes, 1.5).sum(axis=1).tolist() == [3] * 12
    assert in_column(boxes, boxes, 1.5).sum(axis=1).tolist() == [2] * 12
    other = boxes[:1] + np.array([0, 0, 9, 0])
    assert not in_row(other, boxes, 1.5).any()


@pytest.mark.parametrize("missing", [0, 5, 7, 11])
def test_the_place_of_a_missing_window_is_asked_for(missing: int) -> None:
    boxes = grid_of(3, 4)
    asked = places(np.delete(boxes, missing, axis=0), 1.5, (200, 200))
    assert overlap(asked, boxes[missing : missing + 1])[0].max() > 0.95


def test_a_gap_in_a_single_row_is_asked_for_by_its_rhythm() -> None:
    boxes = grid_of(1, 6)
    asked = places(np.delete(boxes, 3, axis=0), 1.5, (200, 60))
    assert overlap(asked, boxes[3:4])[0].max() > 0.95


def test_places_never_leave_the_picture() -> None:
    asked = places(grid_of(2, 2), 1.5, (70, 80))
    assert (asked[:, :2] >= 0).all()
    assert (asked[:, 2] <= 70).all()
    assert (asked[:, 3] <= 80).all()


def test_edges_of_a_row_become_common() -> None:
    rng = np.random.default_rng(1)
    boxes = grid_of(2, 5) + rng.integers(-1, 2, (10, 4))
    out = aligned(boxes, np.ones(10), 3.0)
    assert np.ptp(out[:5, 1]) == np.ptp(out[5:, 3]) == 0
    assert all(np.ptp(out[k::5, 0]) == 0 for k in range(5))
    assert np.abs(out - grid_of(2, 5)).max() <= 1.0


@pytest.mark.parametrize(
    ("sills", "wall_base", "storeys"),
    [
        ([1.0], 0.0, 0), ([1.0, 1.0], 0.0, 1), ([1.0, 3.9, 6.8], 0.0, 3), ([1.0, 6.8, 9.7], 0.0, 4), ([3.9, 6.8], 0.0, 3), ([1.0, 1.1, 3.9], 0.0, 2),
        ([24.0], 0.0, 0), ([9.7] * 6, 0.0, 0), ([12.6, 15.5], 0.0, 0), ([1.0, 20.0], 0.0, 0), ([], 0.0, 0),
    ],
)  # fmt: skip
def test_storeys_follow_from_rows(sills: list[float], wall_base: float, storeys: int) -> None:
    assert storeys_of([(0.0, s, 1.0, s + 1.4) for s in sills], wall_base) == storeys
