"""Which matches of a pair agree with one relative orientation near the given one."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import OrientedImage

STEPS = 8
"""Of the robust adjustment; set by hand, as are those below."""
LEAST_MATCHES = 12
"""Fewer say nothing of the relative orientation."""
LEAST_BASE_M = 1e-4
"""Heads of one system are stated in one place by some programs."""
LEAST_BAND_PX, MOST_BAND_PX = 0.5, 2.5
"""What is kept on both sides of an epipolar line: three standard deviations, within these."""


def agreeing(
    images: tuple[OrientedImage, OrientedImage], uv: tuple[FloatArray, FloatArray], bound_px: float
) -> BoolArray:
    """(K,) which matches lie near their epipolar lines, once the relative orientation is corrected by what most of them say.

    None where there are fewer than `LEAST_MATCHES`, or both images were taken in one place, which leaves no epipolar lines.

    Parameters
    ----------
    uv : (K, 2) image coordinates in each image, pixels
    bound_px : what the correction may be, pixels
    """
    count = len(uv[0])
    if count < LEAST_MATCHES or np.linalg.norm(images[0].centre - images[1].centre) < LEAST_BASE_M:
        return np.zeros(count, bool)
    turned, other, base, across, focal = _relative(images, uv)
    correction = np.zeros(5)
    left = _distances(turned, base, other) * focal
    for _ in range(STEPS):
        spread = max(1.4826 * float(np.median(np.abs(left))), 0.1)
        weight = 1.0 / (1.0 + (left / (2.0 * spread)) ** 2)
        slopes = _slopes(turned, base, across, other, correction) * focal
        normal = (slopes * weight[:, None]).T @ slopes + np.eye(5) * (focal * spread / bound_px) ** 2
        step = np.linalg.solve(
            normal, -(slopes * weight[:, None]).T @ left - (focal * spread / bound_px) ** 2 * correction
        )
        correction = correction + step
        left = _corrected(turned, base, across, other, correction) * focal
    spread = 1.4826 * float(np.median(np.abs(left)))
    return np.asarray(np.abs(left) < np.clip(3.0 * spread, LEAST_BAND_PX, MOST_BAND_PX))


def epipolar_errors(
    images: tuple[OrientedImage, OrientedImage], uv: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """(K,) signed distances of the second points from the epipolar lines of the first, pixels; (K, 5) how they change with the relative orientation.

    Parameters
    ----------
    images : taken in two places
    uv : (K, 2) image coordinates in each image, pixels
    """
    turned, other, base, across, focal = _relative(images, uv)
    return _distances(turned, base, other) * focal, _slopes(turned, base, across, other, np.zeros(5)) * focal


def _relative(
    images: tuple[OrientedImage, OrientedImage], uv: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    """In the frame of the second camera: (K, 3) rays of both images, (3,) way to the first and (2, 3) directions across it; the focal length, pixels."""
    one, other = _normal(images[0], uv[0]), _normal(images[1], uv[1])
    turned = one @ (images[1].rotation @ images[0].rotation.T).T
    base = images[1].rotation @ (images[0].centre - images[1].centre)
    base /= np.linalg.norm(base)
    return turned, other, base, np.linalg.svd(base[None, :])[2][1:], _focal(images[1])


def _normal(image: OrientedImage, uv: FloatArray) -> FloatArray:
    return np.column_stack([image.camera.undistort(uv), np.ones(len(uv))])


def _focal(image: OrientedImage) -> float:
    return float(np.sqrt(image.camera.fx * image.camera.fy))


def _distances(turned: FloatArray, base: FloatArray, other: FloatArray) -> FloatArray:
    lines = np.cross(base, turned)
    return np.sum(lines * other, axis=1) / np.maximum(np.hypot(lines[:, 0], lines[:, 1]), 1e-12)


def _corrected(
    turned: FloatArray, base: FloatArray, across: FloatArray, other: FloatArray, by: FloatArray
) -> FloatArray:
    """Distances after a small turn of the rays (three angles) and of the base (two)."""
    return _distances(turned + np.cross(by[:3], turned), base + by[3:] @ across, other)


def _slopes(turned: FloatArray, base: FloatArray, across: FloatArray, other: FloatArray, at: FloatArray) -> FloatArray:
    step = 1e-6
    columns = [
        (_corrected(turned, base, across, other, at + d) - _corrected(turned, base, across, other, at - d)) / (2 * step)
        for d in np.eye(5) * step
    ]
    return np.stack(columns, axis=1)
