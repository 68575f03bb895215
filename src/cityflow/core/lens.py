"""What a lens does to coordinates x/z, y/z in the camera frame: Brown's polynomials, compiled, and OpenCV's fisheye."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit

UNDISTORT_STEPS = 20
"""Steps at most; they end where nothing changes."""
UNDISTORTED = 1e-11
"""Steps smaller than this change nothing."""

Coefficients = tuple[float, ...]
"""In OpenCV's order: of Brown's lens k1 k2 p1 p2 [k3 [k4 k5 k6]], of a fisheye k1 k2 k3 k4; those that are not given are 0."""


def brown(normal: FloatArray, c: Coefficients, pinhole: tuple[float, float, float, float]) -> FloatArray:
    """(..., 2) coordinates x/z, y/z → (..., 2) image coordinates, pixels, of a camera with fx, fy, cx, cy."""
    flat = np.ascontiguousarray(normal, np.float64).reshape(-1, 2)
    found: FloatArray = _distorted(flat, _filled(c, 8), _floats(pinhole))
    return found.reshape(np.shape(normal))


def from_brown(target: FloatArray, c: Coefficients) -> FloatArray:
    """(..., 2) distorted coordinates → (..., 2) x/z, y/z."""
    flat = np.ascontiguousarray(target, np.float64).reshape(-1, 2)
    found: FloatArray = _undistorted(flat, _filled(c, 8), UNDISTORT_STEPS, UNDISTORTED)
    return found.reshape(target.shape)


def fisheye(normal: FloatArray, c: Coefficients) -> FloatArray:
    """(..., 2) coordinates x/z, y/z → (..., 2) distorted ones."""
    r = np.hypot(normal[..., 0], normal[..., 1])
    scale = np.where(r > 1e-12, _fisheye_radius(np.arctan(r), c) / np.where(r > 1e-12, r, 1.0), 1.0)
    return np.asarray(normal * scale[..., None])


def from_fisheye(target: FloatArray, c: Coefficients) -> FloatArray:
    """(..., 2) distorted coordinates → (..., 2) x/z, y/z."""
    r = np.hypot(target[..., 0], target[..., 1])
    k1, k2, k3, k4 = _filled(c, 4)
    theta = np.minimum(r, 1.55)
    for _ in range(UNDISTORT_STEPS):
        t2 = theta * theta
        slope = 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))
        theta = np.clip(
            theta - (_fisheye_radius(theta, c) - r) / np.where(np.abs(slope) < 1e-6, 1e-6, slope), 0.0, 1.57
        )
    scale = np.where(r > 1e-12, np.tan(theta) / np.where(r > 1e-12, r, 1.0), 1.0)
    return target * scale[..., None]


def _fisheye_radius(theta: FloatArray, c: Coefficients) -> FloatArray:
    k1, k2, k3, k4 = _filled(c, 4)
    t2 = theta * theta
    return theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))


def _filled(c: Coefficients, length: int) -> tuple[float, ...]:
    return (*_floats(c), *(0.0,) * (length - len(c)))


def _floats(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(map(float, values))


@njit(cache=True, nogil=True, inline="always")
def _brown(x, y, c):  # type: ignore[no-untyped-def]
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
