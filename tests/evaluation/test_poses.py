"""Orientations that are off by what is known."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cityflow.core.camera import OrientedImage
from cityflow.evaluation.poses import angle_deg, pose_figures
from cityflow.evaluation.relative_accuracy import block_figures
from cityflow.synthetic.flight import plan_flight, small_rotation
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.pose_noise import PoseErrors, with_pose_noise

LENS = (-0.05, 0.02, 1e-4, -2e-4)
FLIGHT = preset("five_cameras", width_px=900, height_px=600, forward_overlap=0.6, side_overlap=0.4, distortion=LENS)
GSD_M = 0.08
OFF = np.array([0.3, -0.4, 1.2])


@cache
def true() -> tuple[OrientedImage, ...]:
    return plan_flight((0.0, 0.0, 30.0, 30.0), 0.0, FLIGHT)


def ground(seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(0, 30, (60, 2)), rng.uniform(0, 12, 60)])


def elsewhere(images: tuple[OrientedImage, ...]) -> tuple[OrientedImage, ...]:
    """The same block in a frame of its own: turned, half as large, far away."""
    turn, shift = small_rotation(np.array([0.3, 0.2, -2.0])), np.array([100.0, -7.0, 3.0])
    return tuple(replace(i, rotation=i.rotation @ turn.T, centre=0.5 * turn @ i.centre + shift) for i in images)


def test_true_poses_have_no_errors() -> None:
    found = pose_figures(true()[::-1], true())
    assert (found.images, found.missing, found.scale) == (len(true()), 0, 1.0)
    assert found.centre_rmse_m == found.angle_rmse_deg == found.focal_percent == found.principal_px == 0.0


def test_shifts_turns_and_cameras_are_measured() -> None:
    turn = small_rotation(np.array([0.0, 0.0, np.radians(0.2)]))
    camera = replace(
        true()[0].camera, fx=true()[0].camera.fx * 1.001, cx=true()[0].camera.cx + 3.0, cy=true()[0].camera.cy - 4.0
    )
    off = tuple(replace(i, centre=i.centre + OFF, rotation=turn @ i.rotation) for i in true()[1:])
    found = pose_figures((replace(true()[0], camera=camera, centre=true()[0].centre + OFF), *off[1:]), true())
    assert found.missing == 1
    assert found.centre_rmse_m == pytest.approx(1.3)
    assert (found.plan_rmse_m, found.height_rmse_m) == pytest.approx((0.5, 1.2))
    assert found.angle_median_deg == pytest.approx(0.2)
    assert (found.focal_percent, found.principal_px) == pytest.approx((0.1, 5.0))


def test_a_frame_of_its_own_is_moved_onto_the_truth_before() -> None:
    with pytest.raises(ValueError, match="no image"):
        pose_figures(true()[:3], true()[4:])
    found = pose_figures(elsewhere(true()), true(), with_similarity=True)
    assert found.scale == pytest.approx(2.0)
    assert found.centre_rmse_m < 1e-9
    assert found.angle_rmse_deg < 1e-9
    assert pose_figures(elsewhere(true()), true()).centre_rmse_m > 50


def test_small_angles_are_exact() -> None:
    assert angle_deg(np.eye(3), small_rotation(np.array([1e-9, 0, 0]))) == pytest.approx(np.degrees(1e-9), rel=1e-6)


def test_a_block_that_is_turned_as_a_whole_has_no_relative_error() -> None:
    figures = block_figures(true(), true(), ground())
    assert figures.parallax_rms_px < 1e-6
    assert figures.points == 60
    assert max(figures.plan_rmse_m, figures.height_rmse_m) < 1e-6
    assert block_figures(elsewhere(true()), true(), ground()).parallax_rms_px < 1e-6


def test_parallax_of_poses_off_by_themselves_is_that_of_both_images() -> None:
    errors = PoseErrors(angle_px=0.4)
    figures = block_figures(with_pose_noise(true(), errors, 5), true(), ground())
    # both images of a pair have 0.4 pixels across the epipolar line, more away from the image centre (rotation about the axis, slant)
    assert 0.4 * np.sqrt(2) < figures.parallax_rms_px < 0.4 * np.sqrt(2) * 1.35
    assert figures.parallax_median_px < figures.parallax_rms_px < figures.parallax_p95_px
    double = block_figures(with_pose_noise(true(), PoseErrors(angle_px=0.8), 5), true(), ground())
    assert double.parallax_rms_px == pytest.approx(2 * figures.parallax_rms_px, rel=0.02)
    assert 0.02 * GSD_M < figures.height_rmse_m < GSD_M


def test_a_point_that_nothing_shows_is_left_out() -> None:
    xyz = np.concatenate([ground(), [[9000.0, 0.0, 0.0]]])
    assert block_figures(true(), true(), xyz).points == 60
    seen = np.ones((len(true()), 61), bool)
    seen[:, :20] = False
    assert block_figures(true(), true(), xyz, seen).points == 40
    with pytest.raises(ValueError, match="no two images"):
        block_figures(true(), true(), xyz[60:])


def test_a_point_ten_centimetres_too_high_in_all_images_is_found_there() -> None:
    lower = tuple(replace(i, centre=i.centre + np.array([0.0, 0.0, 0.1])) for i in true())
    figures = block_figures(lower, true(), ground())
    assert figures.height_rmse_m == pytest.approx(0.1, abs=1e-6)
    assert figures.plan_rmse_m < 1e-6
