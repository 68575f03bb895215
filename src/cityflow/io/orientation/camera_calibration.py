"""A camera from the calibration of another program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import FISHEYE, Camera
from cityflow.geometry.distortion_fit import (
    BEND,
    australis_corrected,
    fit_distortion,
    image_grid,
    largest_error_px,
    metashape_distorted,
)

MOST_ERROR_PX = 0.3
"""A distortion that OpenCV's terms cannot follow closer than this is refused."""
REMEDY = "undistort the images with the program that calibrated them"


def metashape_camera(plain: Camera, terms: Mapping[str, float]) -> Camera:
    """Metashape's frame camera: k1 to k4, p1, p2, and b1, b2 (affinity and skew, pixels), about the principal point of `plain`.

    Raises
    ------
    ValueError
        Where OpenCV's terms cannot express it.
    """
    b1, b2 = terms.get("b1", 0.0), terms.get("b2", 0.0)
    camera = replace(plain, fx=plain.fx + b1)
    k1, k2, k3, k4, p1, p2 = (terms.get(n, 0.0) for n in ("k1", "k2", "k3", "k4", "p1", "p2"))
    if not k4 and not b2:
        return with_distortion(camera, (k1, k2, p2, p1, k3))
    ideal = image_grid(camera, BEND)
    distorted = metashape_distorted(ideal, (k1, k2, k3, k4), (p1, p2))
    # u = w/2 + cx + x f + x b1 + y b2, with f + b1 in the focal length already
    distorted[:, 0] += distorted[:, 1] * b2 / camera.fx
    return fitted(camera, ideal, distorted)


def metashape_fisheye(plain: Camera, terms: Mapping[str, float]) -> Camera:
    """Metashape's equidistant fisheye: k1 to k4 of the angle.

    Raises
    ------
    ValueError
        Where it has terms that OpenCV's fisheye has not.
    """
    if any(abs(terms.get(n, 0.0)) > limit for n, limit in (("p1", 1e-6), ("p2", 1e-6), ("b2", 1e-3))):
        raise ValueError("a fisheye with tangential distortion or skew cannot be undistorted here")
    k = tuple(terms.get(n, 0.0) for n in ("k1", "k2", "k3", "k4"))
    return replace(plain, fx=plain.fx + terms.get("b1", 0.0), distortion=k, kind=FISHEYE)


def australis_camera(plain: Camera, pixel_mm: float, terms: Mapping[str, float]) -> Camera:
    """Australis' camera: k1 to k3, p1, p2, b1, b2 in millimetres, corrections added to measured coordinates.

    Raises
    ------
    ValueError
        Where OpenCV's terms cannot express it.
    """
    k = terms.get("k1", 0.0), terms.get("k2", 0.0), terms.get("k3", 0.0)
    p, b = (terms.get("p1", 0.0), terms.get("p2", 0.0)), (terms.get("b1", 0.0), terms.get("b2", 0.0))
    distorted = image_grid(plain)
    to_mm = np.array([plain.fx * pixel_mm, -plain.fy * pixel_mm])
    ideal = australis_corrected(distorted * to_mm, k, p, b) / to_mm
    return fitted(plain, ideal, distorted)


def fitted(camera: Camera, ideal: FloatArray, distorted: FloatArray) -> Camera:
    """The camera with the distortion that leads from `ideal` to `distorted` x/z, y/z; focal lengths take up affinity.

    Raises
    ------
    ValueError
        Where the best fit is worse than `MOST_ERROR_PX` somewhere in the image.
    """
    (scale_x, scale_y), distortion = fit_distortion(ideal, distorted)
    result = replace(camera, fx=camera.fx * scale_x, fy=camera.fy * scale_y, distortion=distortion)
    error = largest_error_px(result, ideal, distorted / (scale_x, scale_y))
    if error > MOST_ERROR_PX:
        raise ValueError(f"its distortion cannot be expressed in OpenCV's terms: {error:.1f} pixels are left")
    return result


def with_distortion(camera: Camera, distortion: tuple[float, ...]) -> Camera:
    """The camera with coefficients in OpenCV's order; none where all are zero."""
    return replace(camera, distortion=tuple(distortion) if any(distortion) else ())
