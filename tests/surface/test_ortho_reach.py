"""What hides a place of a frame's tile stands no farther off than is told, and something does stand nearly so far off."""

from __future__ import annotations

import numpy as np
import pytest

from box_scene import view
from cityflow.core.camera import OrientedImage
from cityflow.core.local_frame import LocalFrame
from cityflow.surface.ortho_reach import farthest_hiding, hiding_reach

LOW_M, HIGH_M = 2.0, 30.0
BOUNDS = (-20.0, -15.0, 20.0, 15.0)


def frame_at(tilt_deg: float) -> LocalFrame:
    """Looks north and down."""
    t = np.radians(tilt_deg)
    back = np.array([0.0, -np.sin(t), np.cos(t)])
    east = np.array([1.0, 0.0, 0.0])
    return LocalFrame("north", np.stack([east, np.cross(back, east), back]), np.array([5.0, -3.0, 1.0]))


def farthest(image: OrientedImage, frame: LocalFrame, *, seen_only: bool) -> float:
    """How far in the frame's plan rays run from places of the tile to where they leave the air under the highest object, by brute force."""
    x, y = np.meshgrid(np.linspace(*BOUNDS[0::2], 41), np.linspace(*BOUNDS[1::2], 41))
    found = 0.0
    for level in np.linspace(LOW_M, HIGH_M, 8):
        r, o = frame.frame_from_world, frame.origin
        z = (level - o[2] - r[0, 2] * x - r[1, 2] * y) / r[2, 2]
        places = frame.to_world(np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
        if seen_only:
            uv, depth = image.project(places)
            places = places[(depth > 0) & image.holds(uv)]
        rays = image.centre - places
        ends = places + rays * ((HIGH_M - level) / rays[:, 2])[:, None]
        run = np.linalg.norm((frame.from_world(ends) - frame.from_world(places))[:, :2], axis=1)
        found = max(found, float(run.max(initial=0.0)))
    return found


@pytest.mark.parametrize("tilt", [25.0, 45.0])
@pytest.mark.parametrize("distortion", [(), (0.02, -0.01)])
def test_nothing_hides_from_farther_off(tilt: float, distortion: tuple[float, ...]) -> None:
    frame = frame_at(tilt)
    away = 220.0 * np.array([0.0, -np.sin(np.radians(tilt)), np.cos(np.radians(tilt))])
    images = [
        view(f"v{k}", tuple(away + np.array([k * 25.0, k * 8.0, 0.0])), (k * 25.0, 0.0, 0.0), focal=900.0, distortion=distortion)
        for k in (-1, 0, 1)
    ]  # fmt: skip
    told = hiding_reach(images, frame, BOUNDS, (LOW_M, HIGH_M))
    true = max(farthest(i, frame, seen_only=True) for i in images)
    assert true <= told <= 1.4 * true, "all in the tile may be seen"
    assert told < 0.6 * (HIGH_M - LOW_M), "a rule by the steepest view of all would say much more"


def test_a_picture_that_shows_little_of_the_tile_limits_it() -> None:
    frame = frame_at(45.0)
    narrow = view("narrow", (0.0, -150.0, 150.0), (0.0, 0.0, 0.0), focal=6000.0)
    told = hiding_reach([narrow], frame, BOUNDS, (LOW_M, HIGH_M))
    assert farthest(narrow, frame, seen_only=True) <= told < 0.5 * farthest(narrow, frame, seen_only=False)


def test_level_ground_hides_nothing_and_no_image_neither() -> None:
    frame = frame_at(45.0)
    image = view("one", (0.0, -150.0, 150.0), (0.0, 0.0, 0.0))
    assert hiding_reach([image], frame, BOUNDS, (LOW_M, LOW_M)) == 0.0
    assert hiding_reach([], frame, BOUNDS, (LOW_M, HIGH_M)) == 0.0
    level = view("level", (0.0, -150.0, 5.0), (0.0, 0.0, 5.0), up=(0.0, 0.0, 1.0))
    assert hiding_reach([level], frame, BOUNDS, (LOW_M, HIGH_M)) == np.inf


def test_low_points_far_off_hide_nothing() -> None:
    """A ray moves 0.4 m in plan as it rises by a metre: 20 m over the lowest place it is 8 m away."""
    east = np.array([(20.0 + away, 0.0, 0.0) for away in (1.0, 7.9, 8.1, 12.0)])
    heights = np.full(4, LOW_M + 20.0)
    assert farthest_hiding(east, heights, BOUNDS, LOW_M, 0.4, 0.0) == pytest.approx(7.9)
    assert farthest_hiding(east, heights, BOUNDS, LOW_M, 0.4, 0.5) == pytest.approx(8.1)
    assert farthest_hiding(east, heights - 19.0, BOUNDS, LOW_M, 0.4, 0.0) == 0.0
    corner = np.array([(23.0, 19.0, 0.0), (0.0, 0.0, 0.0)])
    assert farthest_hiding(corner, np.full(2, LOW_M + 13.0), BOUNDS, LOW_M, 0.4, 0.0) == pytest.approx(5.0)
