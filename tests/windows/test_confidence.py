from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.windows.candidates import channels_of, measured
from cityflow.windows.confidence import (
    NAMES,
    WEIGHTS,
    below_another,
    between_close_boxes,
    confidence,
    difference_from_wall,
    ends_unseen,
    features,
    lines_beyond_corners,
    local_deviation,
    unequal_neighbours,
)
from cityflow.windows.facade_picture import Picture
from cityflow.windows.window_parameters import WindowParameters
from drawn_walls import rows_of, wall

P = WindowParameters()


def sure(picture: Picture, boxes: np.ndarray, support: int = 5) -> np.ndarray:
    channels = channels_of(picture, P)
    n = len(boxes)
    return confidence(measured(picture, channels, 0, boxes), np.full(n, support), np.zeros(n), picture, channels)


def test_every_feature_has_a_name_and_a_weight() -> None:
    picture = wall(rows_of(2, 4))
    channels = channels_of(picture, P)
    found = measured(picture, channels, 0, rows_of(2, 4))
    made = features(found, np.full(8, 5), np.zeros(8), picture, channels)
    assert made.shape == (8, len(NAMES))
    assert WEIGHTS.shape == (len(NAMES),)
    assert np.isfinite(made).all()


def test_windows_in_rows_are_sure_and_places_on_plain_wall_are_not() -> None:
    boxes = rows_of(2, 4)
    picture = wall(boxes)
    assert sure(picture, boxes).min() > 0.9
    assert sure(picture, boxes + np.array([16, 0, 16, 0])).max() < 0.1


def test_support_raises_confidence() -> None:
    boxes = rows_of(2, 4)
    picture = wall(boxes)
    values = [sure(picture, boxes, n).mean() for n in (0, 1, 3)]
    assert values == sorted(values)
    assert values[0] < values[-1]


def test_no_box_and_a_place_that_nobody_sees() -> None:
    assert sure(wall(), np.empty((0, 4), np.int64)).shape == (0,)
    picture = wall(rows_of(1, 2))
    unseen = replace(picture, seen=np.zeros_like(picture.seen))
    assert np.isfinite(sure(unseen, rows_of(1, 2))).all()


def test_what_hangs_right_under_another_is_a_parapet() -> None:
    """0.12 m below it; 1.5 m below; at its height beside it."""
    boxes = np.array([(20, 20, 40, 40), (20, 42, 40, 56), (20, 80, 40, 95), (60, 20, 80, 40)])
    assert below_another(boxes, wall()).tolist() == [0, 1, 0, 0]
    assert below_another(boxes[:0], wall()).tolist() == []


def test_letters_follow_close_on_both_sides() -> None:
    """The first and the last of a string have a neighbour on one side only; windows 1.2 m apart none."""
    letters = np.array([(10 + 12 * k, 20, 20 + 12 * k, 34) for k in range(5)])
    assert between_close_boxes(letters, wall()).tolist() == [0, 1, 1, 1, 0]
    assert between_close_boxes(rows_of(1, 4), wall()).tolist() == [0] * 4


def test_boxes_of_other_widths_close_by_are_a_crowd() -> None:
    """A broad and a narrow one beside each other; equal ones are a coupled window."""
    assert unequal_neighbours(np.array([(20, 20, 40, 40), (42, 20, 50, 40)]), wall()).tolist() == pytest.approx(
        [1 / 1.5] * 2
    )
    assert unequal_neighbours(np.array([(20, 20, 40, 40), (42, 20, 62, 40)]), wall()).tolist() == [0, 0]
    assert unequal_neighbours(np.array([(20, 20, 40, 40), (60, 20, 68, 40)]), wall()).tolist() == [0, 0]
    assert unequal_neighbours(np.array([(20, 20, 40, 40), (42, 60, 50, 80)]), wall()).tolist() == [0, 0]


@pytest.mark.parametrize("side", range(4))
def test_a_box_that_ends_where_the_texture_ends_is_known_on_every_side(side: int) -> None:
    box, picture = np.array([(40, 30, 60, 50)]), wall()
    assert ends_unseen(box, picture).tolist() == [0]
    seen = picture.seen.copy()
    (seen[:, :40], seen[:30], seen[:, 60:], seen[50:])[side][...] = False
    assert ends_unseen(box, replace(picture, seen=seen)).tolist() == [1]


def test_a_box_at_the_edge_of_the_picture_ends_unseen() -> None:
    assert ends_unseen(np.array([(0, 30, 20, 50), (140, 30, 160, 50)]), wall()).tolist() == [1, 1]


def test_lines_that_run_on_beyond_the_corners_are_those_of_a_lattice() -> None:
    """Steps along whole columns and rows, against a window whose sides end."""
    boxes = np.array([(60, 40, 80, 60)])
    window = wall(boxes)
    channels = channels_of(window, P)
    assert lines_beyond_corners(channels, measured(window, channels, 0, boxes)).max() < 0.5
    bands = wall()
    bands.light[:, 60:80] -= 0.2
    bands.light[40:60] -= 0.2
    channels = channels_of(bands, P)
    assert lines_beyond_corners(channels, measured(bands, channels, 0, boxes)).min() > 1.5
    stripe = wall()
    stripe.light[:, 60:80] -= 0.2
    channels = channels_of(stripe, P)
    on = lines_beyond_corners(channels, measured(stripe, channels, 0, boxes))[0]
    assert on[0] > 1.5 > 0.5 > on[1]


def test_what_is_as_bright_as_the_wall_is_like_the_wall() -> None:
    """A window, the wall between two, and half of either."""
    picture = wall(rows_of(1, 4))
    off = difference_from_wall(
        np.array([(15, 15, 29, 35), (31, 15, 45, 35), (22, 15, 36, 35)]), picture, channels_of(picture, P)
    )
    assert off[0] == 3.0
    assert off[1] < 0.3


def test_a_plain_wall_is_quiet_and_a_hedge_is_not() -> None:
    plain, rough = wall(), wall(noise=0.01)
    rough.light[::2, ::2] -= 0.3
    assert local_deviation(plain, channels_of(plain, P)) < 1.0
    assert local_deviation(rough, channels_of(plain, P)) > 3.0
    assert local_deviation(replace(plain, seen=np.zeros_like(plain.seen)), channels_of(plain, P)) == 0.0
