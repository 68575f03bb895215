"""Cameras as rows of numbers, so that compiled loops can project through them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import FISHEYE, Camera, OrientedImage

COLUMNS = 30
_CENTRE, _FOCAL, _LENS, _SIZE, _KIND, _REACH = 9, 12, 16, 24, 26, 27
BEYOND = 1.05
"""Distortion is trusted this much farther out than the image's corners: beyond, its polynomial may fold back into the image."""


def packed(images: Sequence[OrientedImage], origin: FloatArray) -> FloatArray:
    """(N, 30) rotation, centre from `origin`, fx fy cx cy, eight coefficients, width, height, fisheye or not, greatest tan², tan across, tan down."""
    rows = np.zeros((len(images), COLUMNS))
    for row, image in zip(rows, images, strict=True):
        camera = image.camera
        row[:_CENTRE] = image.rotation.ravel()
        row[_CENTRE:_FOCAL] = image.centre - origin
        row[_FOCAL:_LENS] = camera.fx, camera.fy, camera.cx, camera.cy
        row[_LENS : _LENS + len(camera.distortion)] = camera.distortion
        row[_SIZE:_KIND] = camera.width, camera.height
        row[_KIND] = camera.kind == FISHEYE
        row[_REACH:] = _reach(camera)
    return rows


def facing(cameras: FloatArray, low: FloatArray, high: FloatArray) -> IntArray:
    """Numbers of the packed cameras that may show something of a box; some may show nothing of it.

    Parameters
    ----------
    low, high : (3,) its corners, metres from the cameras' origin
    """
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    local = np.einsum("nij,nj->ni", cameras[:, :_CENTRE].reshape(-1, 3, 3), middle - cameras[:, _CENTRE:_FOCAL])
    tangent = cameras[:, _REACH + 1 :]
    # distance of the box's middle beyond the planes through the camera and the image's left and right, upper and lower edge
    beyond = (np.abs(local[:, :2]) - local[:, 2:] * tangent) / np.sqrt(1.0 + tangent**2)
    return np.asarray(np.flatnonzero(np.all(beyond <= radius, axis=1) & (local[:, 2] > -radius)))


def _reach(camera: Camera) -> tuple[float, float, float]:
    """Greatest squared tangent of an angle off the axis that the image shows, and the greatest tangents across and down."""
    across, down = np.linspace(0, camera.width, 17), np.linspace(0, camera.height, 17)
    rim = np.concatenate([
        np.column_stack([across, np.zeros(17)]), np.column_stack([across, np.full(17, camera.height)]),
        np.column_stack([np.zeros(17), down]), np.column_stack([np.full(17, camera.width), down]),
    ])  # fmt: skip
    normal = camera.undistort(rim)
    most = np.abs(normal).max(axis=0) * BEYOND
    return float(np.max(np.sum(normal**2, axis=1))) * BEYOND**2, float(most[0]), float(most[1])


@njit(cache=True, nogil=True, inline="always")
def project(row, x, y, z):  # type: ignore[no-untyped-def]
    """Image coordinates and depth of a point; depth 0 where the camera does not look."""
    dx, dy, dz = x - row[9], y - row[10], z - row[11]
    depth = row[6] * dx + row[7] * dy + row[8] * dz
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    a = (row[0] * dx + row[1] * dy + row[2] * dz) / depth
    b = (row[3] * dx + row[4] * dy + row[5] * dz) / depth
    r2 = a * a + b * b
    if r2 > row[27]:
        return 0.0, 0.0, 0.0
    if row[26] != 0.0:
        r = np.sqrt(r2)
        if r > 1e-12:
            t = np.arctan(r)
            t2 = t * t
            scale = t * (1 + t2 * (row[16] + t2 * (row[17] + t2 * (row[18] + t2 * row[19])))) / r
            a, b = a * scale, b * scale
    else:
        radial = (1 + r2 * (row[16] + r2 * (row[17] + r2 * row[20]))) / (
            1 + r2 * (row[21] + r2 * (row[22] + r2 * row[23]))
        )
        p1, p2 = row[18], row[19]
        a, b = (
            a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a),
            b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b,
        )
    return row[12] * a + row[14], row[13] * b + row[15], depth
