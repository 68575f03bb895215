from __future__ import annotations

import numpy as np

from cityflow.windows.agreement import completed_heights
from cityflow.windows.candidates import channels_of
from cityflow.windows.facade_picture import Picture
from cityflow.windows.window_parameters import WindowParameters

TALL = np.array([[20 + 30 * k, 20, 34 + 30 * k, 50] for k in range(5)], np.int64)


def facade(frame: bool) -> Picture:
    """Five dark windows; the lower half of the last one is as bright as the wall, with or without dark sides."""
    light = np.full((80, 180), 0.8, np.float32)
    for left, top, right, bottom in TALL.tolist():
        light[top:bottom, left:right] = 0.3
    left, _, right, _ = TALL[4].tolist()
    light[35:50, left:right] = 0.8
    if frame:
        light[35:50, left : left + 3] = light[35:50, right - 3 : right] = 0.55
    light += np.random.default_rng(1).normal(0, 0.005, light.shape).astype(np.float32)
    everywhere = np.ones(light.shape, bool)
    return Picture(light, np.zeros_like(light), everywhere, everywhere, 0.0, 6.4, 0.08, 0.08)


def completed(frame: bool) -> np.ndarray:
    found = TALL.copy()
    found[4, 3] = 35
    return completed_heights(found, channels_of(facade(frame), WindowParameters()), 2.0)


def test_a_half_becomes_whole_where_its_sides_go_on() -> None:
    assert completed(True).tolist() == TALL.tolist()


def test_a_low_window_beside_high_ones_stays_low() -> None:
    assert completed(False)[4, 3] == 35


def test_one_high_window_says_nothing() -> None:
    boxes = TALL[:3].copy()
    boxes[1:, 3] = 35
    out = completed_heights(boxes, channels_of(facade(True), WindowParameters()), 2.0)
    assert out.tolist() == boxes.tolist()
