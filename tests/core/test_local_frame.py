from __future__ import annotations

import numpy as np

from cityflow.core.local_frame import LocalFrame

HALF = np.sqrt(0.5)
EAST = LocalFrame("east_45", np.array([[HALF, 0, HALF], [0, 1, 0], [-HALF, 0, HALF]]), np.array([100.0, 200.0, 5.0]))
"""Looks to the east and down by 45°: its z axis points up and back to the west."""


def test_a_point_is_where_it_is_by_hand() -> None:
    xyz = np.array([[100.0, 200.0, 5.0], [102.0, 203.0, 5.0], [100.0, 200.0, 7.0]])
    np.testing.assert_allclose(
        EAST.from_world(xyz), [[0, 0, 0], [2 * HALF, 3, -2 * HALF], [2 * HALF, 0, 2 * HALF]], atol=1e-12
    )


def test_what_is_nearer_to_the_cameras_is_higher() -> None:
    """Cameras stand in the west and above."""
    far, near = EAST.from_world(np.array([[110.0, 200.0, 5.0], [100.0, 200.0, 15.0]]))
    assert near[2] > far[2]


def test_back_in_the_world_points_are_where_they_were() -> None:
    """At coordinates of a national grid, to a micrometre."""
    frame = LocalFrame("x", EAST.frame_from_world, np.array([350000.0, 5800000.0, 70.0]))
    xyz = frame.origin + np.random.default_rng(1).uniform(-500, 500, (100, 3))
    np.testing.assert_allclose(frame.to_world(frame.from_world(xyz)), xyz, rtol=0, atol=1e-6)
    assert frame.from_world(np.empty((0, 3))).shape == (0, 3)
