"""Lens distortion models of other programs, fitted by OpenCV's model over the image."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera

GRID = 41
"""Points along each side of the image that the fit goes through."""
ROUNDS = 6
"""Scales and coefficients settle in two or three."""
BEND = 1.1
"""The grid of undistorted points reaches this far beyond the image, since distortion may pull them in."""


def image_grid(camera: Camera, reach: float = 1.0) -> FloatArray:
    """(GRID², 2) x/z, y/z of a regular grid over the image as a camera without distortion sees it."""
    u = camera.width * (0.5 + reach * np.linspace(-0.5, 0.5, GRID))
    v = camera.height * (0.5 + reach * np.linspace(-0.5, 0.5, GRID))
    uv = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    return np.asarray((uv - (camera.cx, camera.cy)) / (camera.fx, camera.fy))


def fit_distortion(ideal: FloatArray, distorted: FloatArray) -> tuple[tuple[float, float], tuple[float, ...]]:
    """Scales of the two axes, and k1 k2 p1 p2 k3, that lead from (N, 2) undistorted to (N, 2) distorted x/z, y/z with the least squares.

    Scales and coefficients multiply each other; a few rounds of the linear problem settle that.
    """
    x, y = ideal.T
    r2, none = x * x + y * y, np.zeros_like(x)
    rows_x = np.stack([x, none, x * r2, x * r2**2, 2 * x * y, r2 + 2 * x * x, x * r2**3], axis=1)
    rows_y = np.stack([none, y, y * r2, y * r2**2, r2 + 2 * y * y, 2 * x * y, y * r2**3], axis=1)
    rows = np.concatenate([rows_x, rows_y])
    size = np.abs(rows).max(axis=0)
    scales, found = np.ones(2), np.zeros(7)
    for _ in range(ROUNDS):
        rest = distorted / scales - ideal
        found = np.linalg.lstsq(rows / size, np.concatenate([rest[:, 0], rest[:, 1]]), rcond=None)[0] / size
        scales = scales * (1 + found[:2])
    return (float(scales[0]), float(scales[1])), tuple(float(v) for v in found[2:])


def metashape_distorted(ideal: FloatArray, k: tuple[float, float, float, float], p: tuple[float, float]) -> FloatArray:
    """(N, 2) distorted x/z, y/z of Metashape's frame model with radial k1 to k4 and tangential p1, p2 (the other way round than OpenCV's)."""
    x, y = ideal.T
    r2 = x * x + y * y
    radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * k[3])))
    return np.stack([
        x * radial + p[0] * (r2 + 2 * x * x) + 2 * p[1] * x * y,
        y * radial + p[1] * (r2 + 2 * y * y) + 2 * p[0] * x * y,
    ], axis=1)  # fmt: skip


def australis_corrected(
    measured_mm: FloatArray, k: tuple[float, float, float], p: tuple[float, float], b: tuple[float, float]
) -> FloatArray:
    """(N, 2) coordinates free of distortion of measured ones, millimetres from the principal point, x right, y up.

    Australis adds its corrections to what is measured: radial K1 to K3, decentring P1, P2, affinity B1 and shear B2.
    """
    x, y = measured_mm.T
    r2 = x * x + y * y
    radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]))
    return np.stack([
        x * radial + p[0] * (r2 + 2 * x * x) + 2 * p[1] * x * y + b[0] * x + b[1] * y,
        y * radial + p[1] * (r2 + 2 * y * y) + 2 * p[0] * x * y,
    ], axis=1)  # fmt: skip


def largest_error_px(camera: Camera, ideal: FloatArray, distorted: FloatArray) -> float:
    """Largest distance between what a camera makes of (N, 2) `ideal` and where the image has it, pixels, within the image."""
    truth = distorted * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    inside = (truth >= 0).all(axis=1) & (truth[:, 0] <= camera.width) & (truth[:, 1] <= camera.height)
    errors = np.linalg.norm(camera.distort(ideal) - truth, axis=1)[inside]
    return float(errors.max(initial=0.0))
