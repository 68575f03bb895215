"""Rectified rows are epipolar lines, disparities and depths are each other's inverse, and what cannot be rectified is refused by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import box_scene
from cityflow.matching.rectification import UnusablePair, rectify

BARREL = (-0.08, 0.02, 1e-4, -2e-4, 0.0)
SETS = {
    "nadir": box_scene.nadir_views(),
    "distorted": box_scene.nadir_views(BARREL),
    "across": box_scene.oblique_views("across"),
    "along": box_scene.oblique_views("along"),
}


@pytest.mark.parametrize("name", SETS)
@pytest.mark.parametrize("lean", [0.0, 0.6])
def test_a_point_lies_on_the_same_row_of_both_images(name: str, lean: float) -> None:
    reference, *partners = SETS[name]
    rng = np.random.default_rng(5)
    xyz = rng.uniform((-8, -6, 0), (8, 6, 6), (200, 3))
    for partner in partners:
        pair = rectify(reference, partner, 0.5, lean)
        uv, depth = reference.project(xyz)
        x, y = pair.rectified(reference.camera.undistort(uv))
        np.testing.assert_allclose(pair.reference_pixels(x, y), uv, atol=1e-6)
        disparity = pair.disparities(x, y, depth)
        np.testing.assert_allclose(pair.partner_pixels(x - disparity, y), partner.project(xyz)[0], atol=1e-5)
        np.testing.assert_allclose(pair.depths(x, y, disparity), depth, rtol=1e-9)
        np.testing.assert_allclose(pair.world(x, y, depth), xyz, atol=1e-6)


@pytest.mark.parametrize("name", SETS)
def test_level_ground_has_no_disparity_and_what_stands_on_it_a_positive_one(name: str) -> None:
    reference, partner, *_ = SETS[name]
    pair = rectify(reference, partner, 0.0, 0.0)
    x, y = np.meshgrid(np.linspace(100, pair.cols - 100, 9), np.linspace(60, pair.rows - 60, 7))
    np.testing.assert_allclose(pair.disparities(x, y, pair.depths_at_height(x, y, 0.0)), 0.0, atol=1e-6)
    assert np.all(pair.disparities(x, y, pair.depths_at_height(x, y, 5.0)) > 1.0)


@pytest.mark.parametrize("name", SETS)
def test_the_base_image_keeps_its_scale_along_the_rows(name: str) -> None:
    reference, *partners = SETS[name]
    for partner in partners:
        pair = rectify(reference, partner, 0.0, 0.0)
        middle = np.array([pair.cols / 2]), np.array([pair.rows / 2])
        step = pair.reference_pixels(middle[0] + 1, middle[1]) - pair.reference_pixels(*middle)
        assert np.linalg.norm(step) == pytest.approx(1.0, abs=0.08)


def test_pairs_that_cannot_be_rectified_are_refused() -> None:
    reference, partner, *_ = box_scene.nadir_views()
    with pytest.raises(UnusablePair, match="too short"):
        rectify(reference, replace(partner, centre=reference.centre + 1e-3), 0.0, 0.0)
    with pytest.raises(UnusablePair, match="along the viewing direction"):
        rectify(reference, replace(partner, centre=reference.centre + 30 * reference.axis), 0.0, 0.0)
    with pytest.raises(UnusablePair, match="epipole"):
        rectify(reference, replace(partner, centre=reference.centre + 30 * reference.axis + (2.0, 0, 0)), 0.0, 0.0)
    with pytest.raises(UnusablePair, match="below the ground"):
        rectify(reference, replace(partner, centre=np.array([9.0, 9.0, -5.0])), 0.0, 0.0)
    up = replace(reference, rotation=reference.rotation @ np.diag([1.0, -1.0, -1.0]))
    with pytest.raises(UnusablePair, match="look down"):
        rectify(up, partner, 0.0, 0.0)
