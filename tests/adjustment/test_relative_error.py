"""The relative error of poses: what was put into them, whatever the noise of the image measurement."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from adjustment.scenes import CAMERA, PIXEL_M, disturbed, scene
from cityflow.adjustment.relative_error import (
    RelativeError,
    Systematic,
    combined,
    height_difference,
    parallax_of,
    systematic,
)
from cityflow.core.camera import OrientedImage
from cityflow.geometry.epipolar import vertical_parallax

LEAST = 60


def _measured(
    images: list[OrientedImage] | tuple[OrientedImage, ...], noise_px: float, seed: int
) -> tuple[RelativeError, float]:
    """A third of the pairs with enough common points, measured with noise where true poses have them; their true vertical parallax, RMS."""
    truth, rng = scene(seed), np.random.default_rng(seed)
    seen = []
    for image in truth.images:
        uv, depth = image.project(truth.xyz)
        seen.append((uv + rng.normal(0, noise_px, uv.shape), image.holds(uv) & (depth > 0)))
    exact = [i.project(truth.xyz)[0] for i in truth.images]
    off = []
    parallax, heights = list[Systematic | None](), list[Systematic | None]()
    for a, b in list(combinations(range(len(images)), 2))[::3]:
        both = seen[a][1] & seen[b][1]
        alike = truth.images[a].axis @ truth.images[b].axis > np.cos(np.radians(40))
        if both.sum() < LEAST or not alike:
            continue
        parallax.append(parallax_of((images[a], images[b]), (seen[a][0][both], seen[b][0][both])))
        off.append(vertical_parallax(images[a], images[b], exact[a][both], exact[b][both]))
        all_three = both & seen[(b + 3) % 24][1]
        if all_three.sum() >= LEAST and (b + 3) % 24 != a and len(heights) < 6:
            third = (b + 3) % 24
            places = seen[a][0][all_three], seen[b][0][all_three], seen[third][0][all_three]
            part = height_difference((images[a], images[b], images[third]), places)
            heights.append(part and Systematic(part.square / PIXEL_M**2, part.noise / PIXEL_M, part.count))
    return combined(parallax, heights), float(np.sqrt(np.mean(np.concatenate(off) ** 2)))


@pytest.mark.parametrize("noise_px", [0.2, 0.8])
def test_exact_poses_have_no_relative_error_whatever_the_noise(noise_px: float) -> None:
    found, _ = _measured(scene(1).images, noise_px, 1)
    assert found.tied == found.pairs > 20
    assert found.parallax_px < 0.1
    assert not found.is_significant
    # a distance from an epipolar line holds the noise of both images
    assert found.noise_px == pytest.approx(np.sqrt(2) * noise_px, rel=0.1)


@pytest.mark.parametrize("noise_px", [0.2, 0.8])
def test_poses_that_are_off_show_their_true_parallax_whatever_the_noise(noise_px: float) -> None:
    truth = scene(2)
    wrong = disturbed(truth.images, 0.02, 0.4, 5)
    found, off_px = _measured(wrong, noise_px, 2)
    assert found.parallax_px == pytest.approx(off_px, rel=0.1)
    assert found.is_significant
    exact, _ = _measured(truth.images, noise_px, 2)
    assert found.height_gsd > 2 * exact.height_gsd
    assert found.expected_nmad_gsd > 4 * exact.expected_nmad_gsd


def test_one_tie_in_ten_that_is_wrong_makes_no_relative_error() -> None:
    rng = np.random.default_rng(3)
    slopes = np.column_stack([np.ones(400), rng.uniform(-1, 1, (400, 4))])
    values = rng.normal(0, 0.5, 400)
    values[::10] += rng.uniform(2, 6, 40)
    assert systematic(slopes, values).square < 0.1**2
    assert systematic(slopes, values + 1.5 * slopes[:, 1]).square == pytest.approx(
        1.5**2 * np.mean(slopes[:, 1] ** 2), rel=0.15
    )


def test_pairs_without_ties_are_a_reason_to_refine_and_none_at_all_say_nothing() -> None:
    part = Systematic(0.0, 0.3, 200)
    assert not combined([part, part, None], []).is_significant
    assert combined([part, None, None], []).is_significant
    nothing = combined([None, None], [])
    assert nothing.tied == 0
    assert not nothing.is_significant


def test_a_sample_too_coarse_to_tell_does_not_claim() -> None:
    coarse = combined([Systematic(0.3**2, 6.0, 60)] * 4, [])
    assert coarse.parallax_px == pytest.approx(0.3)
    assert coarse.sure_px > 0.5
    assert not coarse.is_significant


def test_few_ties_are_none() -> None:
    image = OrientedImage("a", CAMERA, np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 100.0]))
    other = replace(image, centre=np.array([20.0, 0.0, 100.0]))
    uv = np.full((10, 2), 300.0)
    assert parallax_of((image, other), (uv, uv)) is None
