"""Poses that are off come back, exact ones stay, and what is estimated of both is true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adjustment.scenes import CAMERA, PIXEL_M, disturbed, parallax_px, scene
from cityflow.adjustment.block import Block, interior_change, rotation_of, vector_of, with_interior
from cityflow.adjustment.bundle import AdjustmentParameters
from cityflow.adjustment.control_check import placed
from cityflow.adjustment.refinement import on_given_ground, refined, weak_images
from cityflow.adjustment.triangulation import triangulated
from cityflow.geometry.similarity import Similarity

PLAIN = AdjustmentParameters()


def test_poses_that_are_off_come_back_and_their_errors_are_known() -> None:
    truth = scene(5)
    given = disturbed(truth.images, 0.02, 0.4, seed=3)
    found = refined(given, truth.ties, PLAIN)
    assert found.gain.is_significant
    assert parallax_px(given, truth) > 0.5
    assert parallax_px(found.images, truth) < 0.05
    assert found.adjusted.sigma_px == pytest.approx(0.3, rel=0.1)
    assert found.adjusted.position_sigma_m == pytest.approx(0.02, rel=0.35)
    assert found.adjusted.angle_sigma_rad * CAMERA.fx == pytest.approx(0.4, rel=0.35)
    assert found.weak == ()


def test_exact_poses_stay_as_they_are() -> None:
    truth = scene(6)
    found = refined(truth.images, truth.ties, PLAIN)
    assert not found.gain.is_significant
    assert all(a is b for a, b in zip(found.images, truth.images, strict=True))
    adjusted = [found.adjusted.block.image(k, i.name, found.origin) for k, i in enumerate(truth.images)]
    assert parallax_px(adjusted, truth) < 0.05


def test_covariances_tell_the_errors_that_are_left() -> None:
    truth = scene(7)
    given = disturbed(truth.images, 0.05, 1.0, seed=4)
    found = refined(given, truth.ties, PLAIN)
    away = np.array([i.centre - t.centre for i, t in zip(found.images, truth.images, strict=True)])
    told = np.sqrt(np.einsum("nii->ni", found.covariances)[:, 3:])
    ratio = float(np.sqrt(np.mean((away / told) ** 2)))
    assert 0.5 < ratio < 2.0
    assert np.all(np.linalg.norm(away, axis=1) < 5 * PIXEL_M)


def test_what_all_poses_share_makes_no_image_weak() -> None:
    truth = scene(9)
    found = refined(disturbed(truth.images, 1.0, 1.0, seed=6), truth.ties, PLAIN)
    assert np.min(found.sigma_px) > 0.5
    assert found.weak == ()
    less = found.sigma_px.copy()
    less[2] *= 5.0
    assert weak_images([i.name for i in truth.images], found.observations, less) == ("i02",)


def test_an_image_without_ties_keeps_its_pose_and_is_named() -> None:
    truth = scene(8)
    given = disturbed(truth.images, 0.02, 0.4, seed=5)
    ties = truth.ties.some(truth.ties.image != 4)
    found = refined(given, ties, PLAIN)
    assert found.weak == ("i04",)
    assert np.allclose(found.images[4].centre, given[4].centre, atol=1e-6)
    assert np.allclose(found.images[4].rotation, given[4].rotation, atol=1e-9)


def test_one_image_that_is_far_off_does_not_bend_the_others() -> None:
    truth = scene(9)
    given = disturbed(truth.images, 0.02, 0.4, seed=6)
    given[7] = replace(given[7], centre=given[7].centre + np.array([0.4, 0.0, 0.3]))
    found = refined(given, truth.ties, PLAIN)
    assert np.linalg.norm(found.images[7].centre - truth.images[7].centre) < 0.1
    others = [k for k in range(len(given)) if k != 7]
    left = [np.linalg.norm(found.images[k].centre - truth.images[k].centre) for k in others]
    assert np.median(left) < 0.03


def test_a_focal_length_that_is_off_is_found_where_cameras_are_calibrated() -> None:
    truth = scene(10)
    wrong = replace(CAMERA, fx=1503.0, fy=1503.0, cx=612.0)
    given = [replace(i, camera=wrong) for i in disturbed(truth.images, 0.02, 0.4, seed=7)]
    known = AdjustmentParameters(calibrate=True, position_sigma_m=0.02, angle_sigma_deg=0.02)
    found = refined(given, truth.ties, known)
    camera = found.images[0].camera
    assert camera.fx == pytest.approx(1500.0, rel=4e-4)
    assert camera.cx == pytest.approx(610.0, abs=0.8)
    assert parallax_px(found.images, truth) < 0.1


def test_the_ground_stays_where_it_was_given_though_a_camera_is_calibrated() -> None:
    """All images head the same way, so a principal point that is off by 12 px moves all ground that the given poses show by 12 px: outlines lie there."""
    truth = scene(10)
    given = [
        replace(i, camera=replace(CAMERA, cx=CAMERA.cx + 12.0)) for i in disturbed(truth.images, 0.02, 0.4, seed=7)
    ]
    found = refined(given, truth.ties, AdjustmentParameters(calibrate=True))
    block = Block.of(given, found.origin)
    ground = triangulated(block, found.adjusted.ties).xyz + found.origin
    off = found.xyz - ground
    assert np.abs(np.median(off, axis=0)).max() < 0.2 * PIXEL_M
    middle = found.xyz[:, :2] - found.xyz[:, :2].mean(axis=0)
    slope = np.linalg.lstsq(np.column_stack([np.ones(len(off)), middle]), off[:, 2], rcond=None)[0][1:]
    assert np.abs(slope).max() < 1e-3, "nor is it tilted"
    stated = refined(given, truth.ties, AdjustmentParameters(calibrate=True, position_sigma_m=0.02))
    moved = np.mean([i.centre - g.centre for i, g in zip(stated.images, given, strict=True)], axis=0)
    assert np.linalg.norm(moved) < 0.02, "stated positions hold the block instead"
    assert parallax_px(found.images, truth) == pytest.approx(parallax_px(stated.images, truth), abs=0.1)


def test_a_block_that_was_tilted_shifted_and_scaled_goes_back_to_the_ground_that_was_given() -> None:
    truth = scene(10)
    given = Block.of(truth.images, np.zeros(3))
    given = triangulated(replace(given, xyz=np.zeros((truth.ties.points, 3))), truth.ties)
    middle = given.xyz.mean(axis=0)
    moved = placed(
        given,
        Similarity.about(middle, 1.002, rotation_of(np.radians([[0.6, -0.3, 0.1]]))[0], np.array([1.0, -0.5, 0.3])),
    )
    back = on_given_ground(moved, truth.ties, given)
    assert np.abs(moved.xyz - given.xyz).max() > 10 * PIXEL_M
    assert np.abs(back.xyz - given.xyz).max() < 0.01 * PIXEL_M
    assert np.abs(back.centres - given.centres).max() < 0.01 * PIXEL_M
    near = placed(given, Similarity(1.0, np.eye(3), np.array([0.3 * PIXEL_M, 0.0, 0.0])))
    assert on_given_ground(near, truth.ties, given) is near, "less than a pixel shows nowhere"


def test_a_lens_that_the_ties_do_not_show_stays_as_it_was_given() -> None:
    """Ties in the middle of the pictures alone say nothing of distortion: what is known of it must hold, not only each step."""
    known = AdjustmentParameters(calibrate=True, position_sigma_m=0.02, angle_sigma_deg=0.02)
    changes = []
    for seed in (10, 11, 12, 13):
        truth = scene(seed)
        middle = np.hypot(truth.ties.uv[:, 0] - CAMERA.cx, truth.ties.uv[:, 1] - CAMERA.cy) < 130
        given = disturbed(truth.images, 0.02, 0.4, seed=7)
        lens = refined(given, truth.ties.some(middle), known).adjusted.block.cameras[0]
        k1, k2, *_, k3 = interior_change(CAMERA, lens)[3:]
        changes.append(k1)
        assert max(abs(k2), abs(k3)) < 0.001
    # a tenth of what is known of it
    assert np.sqrt(np.mean(np.square(changes))) < 0.01


def test_a_change_of_a_camera_is_told_as_it_was_made() -> None:
    change = np.array([1e-3, -2e-3, 3e-3, 0.01, -0.02, 1e-3, -2e-3, 0.03])
    moved = with_interior(CAMERA, change)
    assert interior_change(CAMERA, moved) == pytest.approx(change)
    assert {type(v) for v in (moved.fx, moved.fy, moved.cx, moved.cy, *moved.distortion)} == {float}


def test_the_same_ties_give_the_same_bytes() -> None:
    truth = scene(5)
    given = disturbed(truth.images, 0.02, 0.4, seed=3)
    one, other = (refined(given, truth.ties, PLAIN) for _ in range(2))
    assert one.covariances.tobytes() == other.covariances.tobytes()
    assert all(a.rotation.tobytes() == b.rotation.tobytes() for a, b in zip(one.images, other.images, strict=True))


def test_nothing_in_common_is_said() -> None:
    truth = scene(5)
    nothing = truth.ties.some(np.zeros(len(truth.ties.point), bool))
    with pytest.raises(ValueError, match="no tie points"):
        refined(truth.images, nothing, PLAIN)


def test_rotation_vectors_and_back() -> None:
    vectors = np.random.default_rng(1).normal(0, 0.3, (20, 3))
    assert np.allclose(vector_of(rotation_of(vectors)), vectors, atol=1e-12)


def test_heads_of_one_data_sheet_are_calibrated_apart() -> None:
    """The level head's focal length is that of the data sheet, that of the tilted ones 0.3 % longer: their images name their heads."""
    longer = replace(CAMERA, fx=1504.5, fy=1504.5)
    names = ("level", "left", "right")
    truth = scene(11, cameras=(CAMERA, longer, longer))
    given = [replace(i, camera=CAMERA, head=names[k % 3]) for k, i in enumerate(truth.images)]
    known = AdjustmentParameters(calibrate=True, position_sigma_m=0.005, angle_sigma_deg=0.02)
    found = refined(disturbed(given, 0.005, 0.4, seed=7), truth.ties, known)
    assert [i.head for i in found.images] == [i.head for i in given]
    lengths = [found.images[k].camera.fx for k in range(3)]
    assert lengths == pytest.approx([1500.0, 1504.5, 1504.5], rel=4e-4)
    merged = refined([replace(i, head="") for i in disturbed(given, 0.005, 0.4, seed=7)], truth.ties, known)
    assert len(merged.adjusted.block.cameras) == 1
    assert abs(merged.images[0].camera.fx - 1500.0) > 2.0
