"""A camera's lens for many points at once, compiled: the same numbers, bit for bit, as `Camera.undistort` and `Camera.distort` give."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import PERSPECTIVE, UNDISTORT_STEPS, UNDISTORTED, Camera
from cityflow.core.kernels import njit

COEFFICIENTS = 8
"""Of a perspective lens: k1 k2 p1 p2 k3 k4 k5 k6."""


def undistorted(camera: Camera, uv: FloatArray) -> FloatArray:
    """(..., 2) image coordinates, pixels → (..., 2) x/z, y/z in the camera frame, to 1e-9 or so inside the image."""
    if not _is_compiled(camera):
        return camera.undistort(uv)
    target = (np.asarray(uv, np.float64) - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    found: FloatArray = _undistorted(target.reshape(-1, 2), _coefficients(camera), UNDISTORT_STEPS, UNDISTORTED)
    return found.reshape(target.shape)


def distorted(camera: Camera, normal: FloatArray) -> FloatArray:
    """(N, 2) coordinates x/z, y/z in the camera frame → (N, 2) image coordinates, pixels."""
    if not _is_compiled(camera):
        return camera.distort(normal)
    found: FloatArray = _distorted(normal, _coefficients(camera), (camera.fx, camera.fy, camera.cx, camera.cy))
    return found


def _is_compiled(camera: Camera) -> bool:
    return camera.kind == PERSPECTIVE and not camera.is_pinhole


def _coefficients(camera: Camera) -> tuple[float, ...]:
    given = tuple(map(float, camera.distortion))
    return (*given, *(0.0,) * (COEFFICIENTS - len(given)))


@njit(cache=True, nogil=True, inline="always")
def _brown(x, y, c):  # type: ignore[no-untyped-def]
    """As `camera._brown`, operation by operation."""
    k1, k2, p1, p2, k3, k4, k5, k6 = c
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


@njit(cache=True, nogil=True, error_model="numpy")
def _undistorted(target, c, most, enough):  # type: ignore[no-untyped-def]
    """Fixed-point steps, until none of the points moves: as with arrays, how often does not depend on a point alone."""
    guess = target.copy()
    for _ in range(most):
        moved = False
        for i in range(len(target)):
            x, y = _brown(guess[i, 0], guess[i, 1], c)
            x, y = target[i, 0] - x, target[i, 1] - y
            guess[i, 0] += x
            guess[i, 1] += y
            moved |= not (abs(x) < enough and abs(y) < enough)
        if not moved:
            break
    return guess


@njit(cache=True, nogil=True, error_model="numpy")
def _distorted(normal, c, pinhole):  # type: ignore[no-untyped-def]
    fx, fy, cx, cy = pinhole
    out = np.empty(normal.shape)
    for i in range(len(normal)):
        x, y = _brown(normal[i, 0], normal[i, 1], c)
        out[i, 0], out[i, 1] = fx * x + cx, fy * y + cy
    return out
