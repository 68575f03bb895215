from __future__ import annotations

import numpy as np
import pytest

from cityflow.windows.candidates import Candidates, channels_of, measured
from cityflow.windows.facade_picture import Picture
from cityflow.windows.proposals import framed, fused, hold_panes
from cityflow.windows.window_parameters import WindowParameters
from drawn_walls import CELL_M, WALL, Box, wall

P = WindowParameters(bars_m=0.0)


def dark(picture: Picture, boxes: list[Box]) -> Candidates:
    return measured(picture, channels_of(picture, P), 0, np.array(boxes, np.int64).reshape(-1, 4))


def fused_boxes(boxes: list[Box]) -> list[list[int]]:
    picture = wall(boxes)
    return [b.tolist() for b in fused(dark(picture, boxes), picture, channels_of(picture, P), P).boxes]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("gap", "whole"), [(2, True), (4, True), (9, False)])
def test_panes_with_a_bar_between_them_are_a_window(gap: int, whole: bool, turned: bool) -> None:
    """Bars of 0.12 and 0.24 m; 0.54 m is a pillar. Side by side, or one above the other."""
    boxes = [(20, 20, 36, 44), (36 + gap, 20, 52 + gap, 44)]
    box = [20, 20, 52 + gap, 44]
    if turned:
        boxes, box = [(b[1], b[0], b[3], b[2]) for b in boxes], [20, 20, 44, 52 + gap]
    assert fused_boxes(boxes) == ([box] if whole else [])


def test_panes_of_different_heights_and_those_that_make_too_large_a_window_stay_apart() -> None:
    assert fused_boxes([(20, 20, 36, 44), (38, 26, 54, 44)]) == []
    assert fused_boxes([(20, 20, 60, 44), (62, 20, 102, 44)]) == []  # 4.9 m wide
    assert fused_boxes([]) == []


def test_a_box_that_holds_panes_is_the_whole() -> None:
    """A fanlight above two panes; one thrice as wide; one four times as high; the panes themselves."""
    panes = np.array([(20, 40, 54, 60)])
    boxes = np.array([(19, 25, 55, 61), (0, 25, 102, 61), (20, -10, 54, 72), (20, 40, 54, 60), (22, 25, 54, 61)])
    assert hold_panes(boxes, panes, wall()).tolist() == [True, False, False, False, False]
    assert hold_panes(boxes, panes[:0], wall()).tolist() == [False] * 5


def test_a_window_grows_over_its_frame_on_all_sides() -> None:
    """Glass of 14 by 20 cells in a bright frame of 0.12 m on a wall in between."""
    picture = wall()
    picture.light[18:42, 38:56] = 0.98
    picture.light[20:40, 40:54] = 0.4
    found = framed(dark(picture, [(40, 20, 54, 40)]), picture, channels_of(picture, P), P)
    assert found.boxes.tolist() == [[38, 18, 56, 42]]
    assert found.channel.tolist() == [1]
    # the frame is there on all sides: cells of 0.06 m, so exact
    assert pytest.approx(0.12) == CELL_M * 2
    assert picture.light[10, 10] == pytest.approx(WALL, abs=0.05)


def test_without_a_frame_or_with_one_on_three_sides_nothing_grows() -> None:
    boxes: list[Box] = [(40, 20, 54, 40)]
    plain = wall(boxes)
    assert len(framed(dark(plain, boxes), plain, channels_of(plain, P), P)) == 0
    open_below = wall()
    open_below.light[18:40, 38:56] = 0.98
    open_below.light[20:40, 40:54] = 0.4
    assert len(framed(dark(open_below, boxes), open_below, channels_of(open_below, P), P)) == 0
