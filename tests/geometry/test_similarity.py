"""Similarities of known parameters."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.geometry.similarity import similarity_between
from cityflow.synthetic.flight import small_rotation


def test_a_similarity_is_found_again() -> None:
    rng = np.random.default_rng(1)
    source = rng.uniform(-50, 50, (7, 3))
    rotation, shift = small_rotation(np.array([0.4, -1.1, 2.0])), np.array([85000.0, 447000.0, 12.0])
    found = similarity_between(source, 3.5 * source @ rotation.T + shift)
    assert found.scale == pytest.approx(3.5, rel=1e-12)
    assert found.rotation == pytest.approx(rotation, abs=1e-12)
    assert found.shift == pytest.approx(shift, abs=1e-7)


def test_a_mirrored_cloud_is_not_mirrored_back() -> None:
    source = np.random.default_rng(2).uniform(-1, 1, (9, 3))
    found = similarity_between(source, source * [1.0, 1.0, -1.0])
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("points", [np.zeros((2, 3)), np.outer(np.arange(5.0), [1.0, 2.0, 3.0])])
def test_what_determines_none_is_refused(points: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"no similarity|on one line"):
        similarity_between(points, points)
