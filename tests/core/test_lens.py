"""The compiled lens gives the numbers of the one that is computed array by array, bit for bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.camera import FISHEYE, Camera
from cityflow.core.lens import distorted, undistorted

PINHOLE = Camera(640, 480, 500.0, 502.0, 310.0, 245.0)
LENSES = [
    PINHOLE,
    replace(PINHOLE, distortion=(-0.1, 0.02, 1e-3, -5e-4, 0.003)),
    replace(PINHOLE, distortion=(-0.21, 0.07)),
    replace(PINHOLE, distortion=(0.1, 0.01, 0.0, 0.0, 0.0, 0.2, 0.01, 0.001)),
    replace(PINHOLE, distortion=(0.02, -0.01, 0.002, -0.001), kind=FISHEYE),
]


@pytest.mark.parametrize("camera", LENSES)
def test_bit_for_bit(camera: Camera) -> None:
    uv = np.random.default_rng(1).uniform(-40, (680, 520), (5000, 2))
    normal = camera.undistort(uv)
    assert undistorted(camera, uv).tobytes() == normal.tobytes()
    assert distorted(camera, normal).tobytes() == camera.distort(normal).tobytes()


def test_any_shape_and_no_point() -> None:
    camera = LENSES[1]
    uv = np.random.default_rng(2).uniform(0, 480, (7, 11, 2))
    assert undistorted(camera, uv).tobytes() == camera.undistort(uv).tobytes()
    assert undistorted(camera, uv).shape == (7, 11, 2)
    assert undistorted(camera, np.empty((0, 2))).shape == (0, 2)


def test_where_no_step_ends_both_go_on_as_long() -> None:
    """Far outside the picture the steps grow; a place that is no number spoils no other."""
    camera = replace(PINHOLE, distortion=(-0.4, 0.3))
    uv = np.random.default_rng(3).uniform(-900, 1600, (400, 2))
    uv[7] = np.nan
    with np.errstate(all="ignore"):
        expected = camera.undistort(uv)
    assert np.array_equal(undistorted(camera, uv), expected, equal_nan=True)
