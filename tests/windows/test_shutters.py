"""Windows between open shutters: both wings are half as wide as the window."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from cityflow.core.arrays import IntArray
from cityflow.windows.candidates import Candidates, candidates, channels_of
from cityflow.windows.facade_picture import Picture
from cityflow.windows.shutters import between_shutters
from cityflow.windows.window_parameters import WindowParameters
from drawn_walls import wall

P = WindowParameters()
SHUT: IntArray = np.array([(12 + 48 * k, 15 + 45 * r, 44 + 48 * k, 40 + 45 * r) for r in range(2) for k in range(3)])
PANES: IntArray = SHUT + np.array([8, 0, -8, 0])


def facade(wing: float, pane: float) -> Picture:
    picture = wall(SHUT, pane=wing, noise=0.008)
    for left, top, right, bottom in PANES.tolist():
        picture.light[top:bottom, left:right] += pane - wing
    return picture


def found_in(picture: Picture) -> Candidates:
    channels = channels_of(picture, P)
    return between_shutters(candidates(picture, channels, P), picture, channels, P)


@pytest.mark.parametrize(("wing", "pane"), [(0.6, 0.3), (0.45, 0.65), (0.5, 0.35)])
def test_panes_are_found_between_their_wings(wing: float, pane: float) -> None:
    """Darker or brighter than the wings, on a wall of 0.8; to a cell, 0.06 m."""
    found = found_in(facade(wing, pane))
    for box, around in zip(PANES, SHUT, strict=True):
        near = np.abs(found.boxes - box).max(axis=1) <= 1
        assert near.any()
        assert (np.abs(found.around[near] - around).max(axis=1) <= 1).all()


def test_windows_without_wings_are_not_said_to_have_some() -> None:
    """As wide as window and wings together, of one brightness."""
    assert len(found_in(facade(0.4, 0.4))) == 0


@pytest.mark.parametrize("sigma", [2.0, 3.0, 4.0])
def test_the_blurred_edge_of_a_window_is_no_wing(sigma: float) -> None:
    """It goes on brightening where a wing would end, but has no second edge there."""
    picture = facade(0.4, 0.4)
    blurred = np.asarray(cv2.GaussianBlur(picture.light, (0, 0), sigma), np.float32)
    assert len(found_in(replace(picture, light=blurred))) == 0


def test_a_plain_wall_has_no_shutters() -> None:
    assert len(found_in(wall())) == 0


def test_one_wing_is_no_pair() -> None:
    picture = wall(SHUT, pane=0.35, noise=0.008)
    for left, top, _, bottom in SHUT.tolist():
        picture.light[top:bottom, left : left + 8] += 0.25
    assert len(found_in(picture)) == 0
