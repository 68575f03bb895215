from __future__ import annotations

import numpy as np
import pytest
from shapely import box

from cityflow.core.building import Semantic
from cityflow.core.texture import FacePlane
from cityflow.evaluation.window_accuracy import compare_windows, on_face, total

TRUE = np.array([[0, 0, 1, 1], [2, 0, 3, 1], [4, 0, 5, 1.0]])
SEEN = np.ones(3, bool)


def test_each_true_window_is_right_once() -> None:
    twice = np.concatenate([TRUE[:1], TRUE[:1] + 0.05, TRUE[1:2]])
    c = compare_windows(twice, TRUE, SEEN)
    assert (c.found, c.right, c.true, c.seen) == (3, 2, 3, 2)
    assert [c.precision, c.recall] == pytest.approx([2 / 3, 2 / 3])


def test_half_of_the_common_area_is_asked_for() -> None:
    assert compare_windows(TRUE + np.array([0.3, 0, 0.3, 0]), TRUE, SEEN).right == 3
    assert compare_windows(TRUE + np.array([0.4, 0, 0.4, 0]), TRUE, SEEN).right == 0


def test_hidden_windows_are_not_asked_for_but_right_when_found() -> None:
    hidden = np.array([True, True, False])
    assert compare_windows(TRUE, TRUE, hidden).right == 3
    c = compare_windows(TRUE[:2], TRUE, hidden)
    assert (c.true, c.seen, c.recall, c.precision) == (2, 2, 1.0, 1.0)
    part = np.concatenate([TRUE[:2], [[4.1, 0.1, 4.9, 0.5]]])
    assert compare_windows(part, TRUE, hidden).found == 2
    assert compare_windows(part, TRUE, SEEN).found == 3


def test_nothing_against_nothing() -> None:
    none = np.empty((0, 4))
    assert compare_windows(none, none, np.zeros(0, bool)).precision == 1.0
    assert compare_windows(TRUE, none, np.zeros(0, bool)).precision == 0.0
    assert compare_windows(none, TRUE, SEEN).recall == 0.0
    assert total([compare_windows(TRUE, TRUE, SEEN)] * 2).right == 6


def test_openings_on_a_face_are_those_in_its_plane_that_look_the_same_way() -> None:
    face = FacePlane(
        ("solid", 0), Semantic.WALL, (), np.array([10.0, 20, 0]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), np.array([0, -1.0, 0]), box(0, 0, 9, 9)
    )  # fmt: skip
    pane = np.array([[11, 20, 1], [12, 20, 1], [12, 20, 2], [11, 20, 2.0]])
    behind, turned = pane + np.array([0, 0.5, 0]), pane[::-1]
    bounds, on = on_face(face, np.stack([pane, behind, turned]), 0.2)
    assert on.tolist() == [True, False, False]
    assert bounds[0].tolist() == [1, 1, 2, 2]
