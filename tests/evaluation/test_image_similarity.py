from __future__ import annotations

import numpy as np
import pytest

from image_similarity import fitted_gain, image_similarity


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
