"""The compiled lens gives the numbers of one that is computed array by array, bit for bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera
from cityflow.core.lens import UNDISTORT_STEPS, UNDISTORTED

PINHOLE = Camera(640, 480, 500.0, 502.0, 310.0, 245.0)
LENSES = [
    replace(PINHOLE, distortion=(-0.1, 0.02, 1e-3, -5e-4, 0.003)),
    replace(PINHOLE, distortion=(-0.21, 0.07)),
    replace(PINHOLE, distortion=(0.1, 0.01, 0.0, 0.0, 0.0, 0.2, 0.01, 0.001)),
]


def brown(camera: Camera, normal: FloatArray) -> FloatArray:
    """(..., 2) coordinates in the camera frame → (..., 2) distorted ones."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*camera.distortion, *(0.0,) * (8 - len(camera.distortion)))
    x, y = normal[..., 0], normal[..., 1]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return np.stack(
        [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
        axis=-1,
    )


def distorted(camera: Camera, normal: FloatArray) -> FloatArray:
    x, y = np.moveaxis(brown(camera, normal), -1, 0)
    return np.stack([camera.fx * x + camera.cx, camera.fy * y + camera.cy], axis=-1)


def undistorted(camera: Camera, uv: FloatArray) -> FloatArray:
    target = (uv - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    guess = target.copy()
    for _ in range(UNDISTORT_STEPS):
        step = target - brown(camera, guess)
        guess += step
        if float(np.max(np.abs(step), initial=0.0)) < UNDISTORTED:
            break
    return guess


@pytest.mark.parametrize("camera", LENSES)
def test_bit_for_bit(camera: Camera) -> None:
    uv = np.random.default_rng(1).uniform(-40, (680, 520), (5000, 2))
    normal = undistorted(camera, uv)
    assert camera.undistort(uv).tobytes() == normal.tobytes()
    assert camera.distort(normal).tobytes() == distorted(camera, normal).tobytes()


def test_any_shape_and_no_point() -> None:
    camera = LENSES[1]
    uv = np.random.default_rng(2).uniform(0, 480, (7, 11, 2))
    normal = camera.undistort(uv)
    assert normal.tobytes() == undistorted(camera, uv).tobytes()
    assert camera.undistort(uv).shape == (7, 11, 2)
    assert camera.distort(normal[:, ::2]).tobytes() == distorted(camera, normal[:, ::2]).tobytes()
    assert camera.distort(normal[3, 4]).shape == (2,)
    assert camera.undistort(np.empty((0, 2))).shape == (0, 2)


def test_where_no_step_ends_both_go_on_as_long() -> None:
    """Far outside the picture the steps grow; a place that is no number spoils no other."""
    camera = replace(PINHOLE, distortion=(-0.4, 0.3))
    uv = np.random.default_rng(3).uniform(-900, 1600, (400, 2))
    uv[7] = np.nan
    with np.errstate(all="ignore"):
        expected = undistorted(camera, uv)
    assert np.array_equal(camera.undistort(uv), expected, equal_nan=True)
