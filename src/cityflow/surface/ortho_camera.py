"""Cameras as arrays, so that compiled loops can project through them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import FISHEYE, Camera, OrientedImage
from cityflow.core.kernels import njit

BEYOND = 1.05
"""Distortion is trusted this much farther out than the image's corners: beyond, its polynomial may fold back into the image."""

ROUNDED_M = 1e-6
"""Far more than a distance from a plane is rounded by."""
K1, K2, P1, P2, K3, K4, K5, K6 = range(8)
"""Columns of the distortion of a perspective camera (OpenCV's order)."""
F1, F2, F3, F4 = range(4)
"""Those of a fisheye lens."""


class Cameras(NamedTuple):
    """Of N images.

    Attributes
    ----------
    rotation : (N, 3, 3) camera from world
    centre : (N, 3) metres from an origin
    focal, middle, size : (N, 2) fx and fy, cx and cy, width and height, pixels
    distortion : (N, 8) coefficients
    fisheye : (N,)
    tangent2 : (N,) greatest squared tangent of an angle off the axis that the image shows
    tangent : (N, 2) greatest tangents across and down
    """

    rotation: FloatArray
    centre: FloatArray
    focal: FloatArray
    middle: FloatArray
    size: FloatArray
    distortion: FloatArray
    fisheye: BoolArray
    tangent2: FloatArray
    tangent: FloatArray

    def take(self, chosen: IntArray) -> Cameras:
        return Cameras._make(values[chosen] for values in self)


def packed(images: Sequence[OrientedImage], origin: FloatArray) -> Cameras:
    """The cameras of images, seen from an origin (3,), world metres."""
    cameras = [image.camera for image in images]
    distortion = np.zeros((len(images), 8))
    for row, camera in zip(distortion, cameras, strict=True):
        row[: len(camera.distortion)] = camera.distortion
    reach = np.array([_reach(camera) for camera in cameras])
    return Cameras(
        np.array([image.rotation for image in images], float), np.array([image.centre - origin for image in images]),
        np.array([(c.fx, c.fy) for c in cameras], float), np.array([(c.cx, c.cy) for c in cameras], float),
        np.array([(c.width, c.height) for c in cameras], float), distortion,
        np.array([c.kind == FISHEYE for c in cameras]), reach[:, 0].copy(), reach[:, 1:].copy(),
    )  # fmt: skip


def facing(cameras: Cameras, low: FloatArray, high: FloatArray) -> IntArray:
    """Numbers of the cameras that may show something of a box; some may show nothing of it.

    Parameters
    ----------
    low, high : (3,) its corners, metres from the cameras' origin
    """
    middle, half = (low + high) / 2, (high - low) / 2
    along = cameras.rotation[:, 2:]
    # planes through the camera and the image's left, upper, right and lower edge, and the one through the camera that it looks away from
    edges = cameras.rotation[:, :2], cameras.tangent[:, :, None] * along
    normal = np.concatenate([-edges[0] - edges[1], edges[0] - edges[1], -along], axis=1)
    beyond = np.einsum("nkj,nj->nk", normal, middle - cameras.centre) - np.abs(normal) @ half
    return np.asarray(np.flatnonzero(np.all(beyond <= ROUNDED_M, axis=1)))


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
def lens_of(cameras, i):  # type: ignore[no-untyped-def]
    """One of the cameras as numbers, for `project`: projection centre, rotation, distortion, focal lengths and principal point, greatest squared tangent."""
    p, r, k, f, m = cameras.centre, cameras.rotation, cameras.distortion, cameras.focal, cameras.middle
    return (
        (p[i, 0], p[i, 1], p[i, 2]),
        (r[i, 0, 0], r[i, 0, 1], r[i, 0, 2], r[i, 1, 0], r[i, 1, 1], r[i, 1, 2], r[i, 2, 0], r[i, 2, 1], r[i, 2, 2]),
        (k[i, 0], k[i, 1], k[i, 2], k[i, 3], k[i, 4], k[i, 5], k[i, 6], k[i, 7]),
        (f[i, 0], f[i, 1], m[i, 0], m[i, 1], cameras.tangent2[i]),
    )


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def project(lens, fisheye, x, y, z):  # type: ignore[no-untyped-def]
    """Image coordinates and depth of a point in a camera; depth 0 where it does not look. Without a branch, but for fisheyes."""
    (x_0, y_0, z_0), (r_0, r_1, r_2, r_3, r_4, r_5, r_6, r_7, r_8), k, (fx, fy, cx, cy, most) = lens
    dx, dy, dz = x - x_0, y - y_0, z - z_0
    depth = r_6 * dx + r_7 * dy + r_8 * dz
    a = (r_0 * dx + r_1 * dy + r_2 * dz) / depth
    b = (r_3 * dx + r_4 * dy + r_5 * dz) / depth
    r2 = a * a + b * b
    seen = (depth > 0.0) & (r2 <= most)
    if fisheye:
        off = np.sqrt(r2)
        if off > 1e-12:
            t = np.arctan(off)
            t2 = t * t
            scale = t * (1 + t2 * (k[F1] + t2 * (k[F2] + t2 * (k[F3] + t2 * k[F4])))) / off
            a, b = a * scale, b * scale
    else:
        radial = (1 + r2 * (k[K1] + r2 * (k[K2] + r2 * k[K3]))) / (1 + r2 * (k[K4] + r2 * (k[K5] + r2 * k[K6])))
        p1, p2 = k[P1], k[P2]
        a, b = (
            a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a),
            b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b,
        )
    return fx * a + cx, fy * b + cy, depth if seen else 0.0
