"""Walls and corners floor by floor."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.evaluation.storey_walls import compare_storeys, together
from stacked_boxes import LEVELS, PLAIN, Boxes, arcade_and_set_back


def test_the_truth_against_itself_has_no_errors() -> None:
    walls = compare_storeys(arcade_and_set_back(), arcade_and_set_back(), LEVELS)
    assert len(walls.wall_m) == len(walls.beyond_m) == 4 * (58 + 64 + 60)
    assert walls.wall_m.max() == walls.beyond_m.max() == 0
    assert len(walls.corner_m) == 12
    assert (walls.missed, walls.invented) == (0, 0)


def test_walls_that_are_off_are_measured_on_their_floor() -> None:
    walls = compare_storeys(arcade_and_set_back(), arcade_and_set_back(arcade=2.9), LEVELS)
    assert np.isclose(walls.wall_m, 0.1).sum() == pytest.approx(80, abs=2)
    assert np.sort(walls.corner_m)[-2:] == pytest.approx(0.1)
    assert walls.wall_m.max() == pytest.approx(0.1)


def test_a_missing_storey_is_infinitely_far_and_its_corners_are_missed() -> None:
    walls = compare_storeys(PLAIN, Boxes((((0, 0, 20, 12), (0, 6.4)),)), LEVELS)
    assert np.isinf(walls.wall_m).mean() == pytest.approx(1 / 3)
    assert (walls.missed, walls.invented, len(walls.corner_m)) == (4, 0, 8)


def test_corners_a_metre_away_are_missed_and_invented() -> None:
    walls = compare_storeys(PLAIN, Boxes((((0, 0, 20, 14), (0, 9.6)),)), LEVELS)
    assert (walls.missed, walls.invented, len(walls.corner_m)) == (6, 6, 6)
    assert together([walls, walls]).missed == 12


def test_a_corner_is_used_once() -> None:
    notched = Boxes((((0, 0, 20, 12), (0, 9.6)), ((-0.3, 0, 0, 11.7), (0, 9.6))))
    walls = compare_storeys(PLAIN, notched, LEVELS)
    assert (walls.missed, walls.invented) == (0, 6)
