from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.windows.facade_picture import Picture
from cityflow.windows.panels import barred, panelled
from drawn_walls import CELL_M, wall


def boxes(rows: int, columns: int, size: tuple[float, float], pitch: tuple[float, float]) -> np.ndarray:
    """Metres."""
    s, t = np.meshgrid(pitch[0] * np.arange(columns), pitch[1] * np.arange(rows))
    low = np.stack([s.ravel(), t.ravel()], axis=1)
    return np.concatenate([low, low + size], axis=1)


@pytest.mark.parametrize(
    ("pitch", "tight"), [((1.3, 1.5), True), ((1.3, 2.9), False), ((2.0, 1.5), False), ((2.0, 2.9), False)]
)
def test_boxes_close_in_both_directions_are_panels(pitch: tuple[float, float], tight: bool) -> None:
    """1.2 by 1.4 m with joints of 0.1 m; ribbons of windows and coupled ones are close in one direction only."""
    assert panelled(boxes(3, 4, (1.2, 1.4), pitch), 0.1) == tight


def test_a_coarse_picture_shows_joints_that_are_wider() -> None:
    made = boxes(3, 4, (1.2, 1.4), (1.6, 1.8))
    assert not panelled(made, 0.1)
    assert panelled(made, 0.5)


def test_few_boxes_and_none_tell_nothing() -> None:
    assert not panelled(boxes(1, 5, (1.2, 1.4), (1.3, 1.5)), 0.1)
    assert not panelled(np.empty((0, 4)), 0.1)


def test_the_order_of_boxes_and_where_they_stand_do_not_matter() -> None:
    made = boxes(3, 4, (1.2, 1.4), (1.3, 1.5))
    shuffled = np.random.default_rng(1).permutation(made) + np.array([50.0, -7.0, 50.0, -7.0])
    assert panelled(shuffled, 0.1)


def with_bars(upright_m: float, level_m: float, length: float = 1.0) -> Picture:
    """A wall of 12 m by 9 m with dark bars of two cells so far apart, over a share of its height."""
    picture = wall(shape=(150, 200))
    light = picture.light.copy()
    high = round(length * 150)
    for every, view in ((upright_m, light[:high]), (level_m, light.T)):
        if every:
            for k in range(round(every / CELL_M), view.shape[1] - 5, round(every / CELL_M)):
                view[:, k : k + 2] -= 0.2
    return replace(picture, light=light)


@pytest.mark.parametrize(
    ("upright", "level", "bars"),
    [(1.2, 2.0, True), (1.2, 0.0, False), (0.0, 2.0, False), (4.0, 2.0, False), (1.2, 4.4, False), (0.0, 0.0, False)],
)
def test_bars_must_run_both_ways_and_stand_close(upright: float, level: float, bars: bool) -> None:
    assert barred(with_bars(upright, level)) == bars


def test_bars_over_half_of_the_height_are_none() -> None:
    assert not barred(with_bars(1.2, 2.0, length=0.5))


def test_upright_bars_alone_tell_where_nothing_is_a_window() -> None:
    """As close as mullions, not as boards."""
    assert barred(with_bars(1.2, 0.0), empty=True)
    assert not barred(with_bars(0.3, 0.0), empty=True)
    assert not barred(with_bars(0.0, 0.0), empty=True)


def test_bright_bars_count_as_dark_ones() -> None:
    picture = with_bars(1.2, 2.0)
    assert barred(replace(picture, light=1.0 - picture.light))


def test_what_nobody_sees_has_no_bars_and_a_small_wall_neither() -> None:
    picture = with_bars(1.2, 2.0)
    assert not barred(replace(picture, seen=np.zeros_like(picture.seen)))
    assert not barred(wall(shape=(10, 10)), empty=True)
