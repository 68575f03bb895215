from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.windows.candidates import Candidates, at_wall_base, candidates, channels_of, measured, sized, within_wall
from cityflow.windows.window_parameters import WindowParameters
from drawn_walls import CELL_M, Box, rows_of, wall

P = WindowParameters()
DARK_CHANNEL, BRIGHT_CHANNEL = 0, 1


@pytest.mark.parametrize(("pane", "channel"), [(0.35, DARK_CHANNEL), (0.98, BRIGHT_CHANNEL)])
def test_windows_are_candidates_of_their_channel_to_the_cell(pane: float, channel: int) -> None:
    boxes = rows_of(2, 4)
    picture = wall(boxes, pane=pane)
    found = candidates(picture, channels_of(picture, P), P)
    for box in boxes:
        same = (np.abs(found.boxes - box).max(axis=1) <= 1) & (found.channel == channel)
        assert same.any()
        assert found.sides[same].min() > 0.8
        assert (found.seen[same] == 1.0).all()


def test_a_plain_wall_has_next_to_no_candidates() -> None:
    picture = wall()
    assert len(candidates(picture, channels_of(picture, P), P)) <= 1


def test_sides_say_which_of_them_are_there() -> None:
    """A box whose right half is wall has three sides; one on plain wall has none."""
    picture = wall(rows_of(1, 1))
    channels = channels_of(picture, P)
    asked = np.array([(15, 15, 29, 35), (15, 15, 43, 35), (80, 50, 94, 70)])
    made = measured(picture, channels, DARK_CHANNEL, asked)
    np.testing.assert_allclose(made.sides[0], 1.0, atol=0.11)
    assert made.sides[1] == pytest.approx([1.0, 0.5, 0.0, 0.5], abs=0.11)
    assert made.sides[2].max() < 0.2
    assert made.contrast[0] > made.contrast[1] > made.contrast[2]
    assert made.soundness[0] > 0.9 > made.soundness[1] > made.soundness[2]
    assert measured(picture, channels, BRIGHT_CHANNEL, asked[:1]).contrast[0] < 0


def test_what_is_seen_is_the_share_of_true_texture() -> None:
    picture = wall(rows_of(1, 1))
    seen = picture.seen.copy()
    seen[:, 22:] = False
    made = measured(replace(picture, seen=seen), channels_of(picture, P), DARK_CHANNEL, np.array([(15, 15, 29, 35)]))
    assert made.seen[0] == 1.0
    picture = replace(picture, seen=seen)
    assert measured(picture, channels_of(picture, P), DARK_CHANNEL, np.array([(15, 15, 29, 35)])).seen[
        0
    ] == pytest.approx(0.5)


def test_without_colour_there_are_two_looks_and_with_it_four() -> None:
    picture = wall(rows_of(1, 1))
    assert len(channels_of(picture, P)) == 2
    hue = picture.hue.copy()
    hue[15:35, 15:29] = 0.2
    assert len(channels_of(replace(picture, hue=hue), P)) == 4


@pytest.mark.parametrize(
    ("wide_m", "high_m", "fits"),
    [(0.36, 1.2, False), (0.42, 1.2, True), (0.9, 3.96, False), (1.02, 3.96, True), (1.2, 4.08, False), (2.4, 0.6, True), (2.46, 0.6, False)],
)  # fmt: skip
def test_sizes_of_windows(wide_m: float, high_m: float, fits: bool) -> None:
    """Sides from 0.4 to 4 m, the longer at most four times the shorter."""
    box = np.array([[10, 10, 10 + round(wide_m / CELL_M), 10 + round(high_m / CELL_M)]])
    assert sized(box, wall(), P).tolist() == [fits]


def test_wall_remains_around_a_window() -> None:
    """0.15 m are two cells; below a door there need be none."""
    picture = wall()
    boxes = np.array([(2, 2, 20, 30), (1, 20, 20, 40), (140, 60, 158, 98), (140, 60, 158, 100)])
    assert within_wall(boxes, picture, np.zeros(4, bool)).tolist() == [True, False, True, False]
    assert within_wall(boxes, picture, np.ones(4, bool)).tolist() == [True, False, True, True]


@pytest.mark.parametrize(
    ("box", "standing"),
    [((20, 65, 37, 100), True), ((20, 40, 37, 75), False), ((20, 80, 37, 100), False), ((20, 65, 50, 100), False), ((20, 70, 56, 100), True)],
)  # fmt: skip
def test_doors_and_gates_are_at_the_wall_base(box: Box, standing: bool) -> None:
    """A door, the same in mid-wall, a low window at the foot, something as wide as high, and a gate of 2.2 by 1.8 m."""
    assert at_wall_base(np.array([box]), wall()).tolist() == [standing]


def test_chosen_and_joined_candidates_keep_what_belongs_to_them() -> None:
    picture = wall(rows_of(1, 4))
    channels = channels_of(picture, P)
    one, two = (measured(picture, channels, k, rows_of(1, 4)) for k in (0, 1))
    both = Candidates.joined([one.of(np.array([2])), two.of(np.zeros(0, int)), two.of(np.array([3, 0]))])
    assert both.boxes[:, 0].tolist() == [85, 120, 15]
    assert both.channel.tolist() == [0, 1, 1]
    assert both.contrast[1] == two.contrast[3]
    assert len(both.of(np.zeros(3, bool))) == 0
