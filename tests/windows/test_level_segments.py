from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.windows.box_edges import BRIGHT, DARK, edges_of
from cityflow.windows.facade_picture import Picture
from cityflow.windows.level_segments import segments
from cityflow.windows.window_parameters import WindowParameters
from drawn_walls import rows_of, wall

P = WindowParameters(bars_m=0.0)


def found(picture: Picture, sign: int = DARK) -> set[tuple[int, ...]]:
    return {tuple(b) for b in segments(picture, edges_of(picture, picture.light, sign, P), sign, P).tolist()}


@pytest.mark.parametrize("sign", [DARK, BRIGHT])
def test_windows_darker_or_brighter_than_their_wall_are_among_the_segments(sign: int) -> None:
    boxes = rows_of(2, 4)
    picture = wall(boxes, pane=0.8 + sign * 0.3)
    assert {tuple(b) for b in boxes.tolist()} <= found(picture, sign)
    assert not {tuple(b) for b in boxes.tolist()} & found(picture, -sign)


def test_a_window_in_the_shade_is_found_at_its_own_brightness() -> None:
    """Half of the wall is in the shade, as dark as the windows in the sun."""
    boxes = rows_of(1, 4)
    picture = wall(boxes)
    light = picture.light.copy()
    light[:, 80:] -= 0.3
    assert {tuple(b) for b in boxes.tolist()} <= found(replace(picture, light=light))


@pytest.mark.parametrize("size", [(4, 20), (80, 20), (6, 40)])
def test_what_is_too_narrow_too_wide_or_too_long_is_none(size: tuple[int, int]) -> None:
    """Cells of 0.06 m: sides from 0.4 to 4 m, the longer up to four times the shorter."""
    box = (20, 20, 20 + size[0], 20 + size[1])
    assert not any(abs(b[2] - b[0] - size[0]) <= 1 and abs(b[3] - b[1] - size[1]) <= 1 for b in found(wall([box])))


def test_what_fills_little_of_its_box_is_none() -> None:
    """Two arms of a right angle, 5 of 20 cells wide each: 44 % of the box."""
    picture = wall([(20, 20, 25, 40), (20, 35, 40, 40)])
    assert (20, 20, 40, 40) not in found(picture)


def test_a_wall_that_nobody_sees_or_that_ends_has_none() -> None:
    picture = wall(rows_of(1, 2))
    nowhere = np.zeros(picture.light.shape, bool)
    assert not found(replace(picture, seen=nowhere))
    assert not found(replace(picture, wall=nowhere))


def test_every_box_comes_once_and_none_on_a_plain_wall_of_a_size_that_noise_has_not() -> None:
    picture = wall(rows_of(2, 4))
    boxes = segments(picture, edges_of(picture, picture.light, DARK, P), DARK, P)
    assert len(np.unique(boxes, axis=0)) == len(boxes)
    assert not found(wall(noise=0.0))
