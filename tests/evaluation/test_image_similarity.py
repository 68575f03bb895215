from __future__ import annotations

import numpy as np
import pytest

from cityflow.evaluation.image_similarity import delta_e_2000, fitted_gain, image_similarity, lab_of, ssim_map

# Sharma, Wu and Dalal 2005, table 1: rows where hues wrap, are opposite, or where the blue term turns; L a b, L a b, difference
SHARMA = np.array([
    (50.0, 2.6772, -79.7751, 50.0, 0.0, -82.7485, 2.0425), (50.0, -1.3802, -84.2814, 50.0, 0.0, -82.7485, 1.0),
    (50.0, 0.0, 0.0, 50.0, -1.0, 2.0, 2.3669), (50.0, 2.49, -0.001, 50.0, -2.49, 0.0009, 7.1792),
    (50.0, 2.49, -0.001, 50.0, -2.49, 0.0011, 7.2195), (50.0, -0.001, 2.49, 50.0, 0.0009, -2.49, 4.8045),
    (50.0, -0.001, 2.49, 50.0, 0.0011, -2.49, 4.7461), (50.0, 2.5, 0.0, 50.0, 0.0, -2.5, 4.3065),
    (50.0, 2.5, 0.0, 73.0, 25.0, -18.0, 27.1492), (50.0, 2.5, 0.0, 56.0, -27.0, -3.0, 31.9030),
    (22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373), (2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082),
])  # fmt: skip


def test_published_colour_differences() -> None:
    assert delta_e_2000(SHARMA[:, :3], SHARMA[:, 3:6]) == pytest.approx(SHARMA[:, 6], abs=5e-5)


def test_colours_as_another_library_has_them() -> None:
    color = pytest.importorskip("skimage.color")
    rgb = np.random.default_rng(0).uniform(0, 255, (200, 3))
    assert lab_of(rgb) == pytest.approx(color.rgb2lab(rgb[None] / 255.0)[0], abs=0.01)


def test_similarity_as_another_library_has_it() -> None:
    metrics = pytest.importorskip("skimage.metrics")
    rng = np.random.default_rng(0)
    one = rng.uniform(0, 255, (60, 80))
    two = 0.7 * one + rng.uniform(0, 60, one.shape)
    _, whole = metrics.structural_similarity(
        one, two, data_range=255, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True
    )
    assert ssim_map(one, two) == pytest.approx(whole, abs=1e-9)


def test_gain_of_an_exposure_is_found_and_taken_out() -> None:
    rng = np.random.default_rng(1)
    reference = rng.uniform(10, 120, (40, 50, 3)).astype(np.float32)
    picture = np.asarray(reference / np.array([0.5, 1.25, 0.8], np.float32), np.float32)
    assert fitted_gain(picture.reshape(-1, 3), reference.reshape(-1, 3)) == pytest.approx([0.5, 1.25, 0.8], rel=1e-5)
    found = image_similarity(picture, reference, np.ones(reference.shape[:2], bool))
    assert found.ssim > 0.9999
    assert found.delta_e < 0.01


def test_only_what_is_asked_for_counts() -> None:
    rng = np.random.default_rng(2)
    reference = rng.uniform(10, 200, (60, 60, 3)).astype(np.float32)
    picture, of = reference.copy(), np.zeros((60, 60), bool)
    of[20:40, 20:40] = True
    picture[:10] = 0
    assert image_similarity(picture, reference, of).delta_e == 0.0
    picture[20:40, 20:40] = 255 - picture[20:40, 20:40]
    assert image_similarity(picture, reference, of).ssim < 0.2
