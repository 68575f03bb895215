"""Two images of known orientation: how far points are off their epipolar lines, and where rays of several images meet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import OrientedImage


def vertical_parallax(
    first: OrientedImage, second: OrientedImage, uv_first: FloatArray, uv_second: FloatArray
) -> FloatArray:
    """(N,) signed distances of points of the second image from the epipolar lines of the first image's, pixels of the second without distortion.

    Parameters
    ----------
    uv_first, uv_second : (N, 2) image coordinates of the same places, pixels; NaN for a base of no length
    """
    rays = first.rays(uv_first) @ second.rotation.T
    base = second.rotation @ (first.centre - second.centre)
    line = np.cross(base, rays)
    normal = second.camera.undistort(uv_second)
    length = np.hypot(line[:, 0], line[:, 1])
    off = line[:, 0] * normal[:, 0] + line[:, 1] * normal[:, 1] + line[:, 2]
    focal = np.sqrt(second.camera.fx * second.camera.fy)
    return np.asarray(np.divide(off, length, out=np.full(len(off), np.nan), where=length > 0) * focal)


def intersections(images: Sequence[OrientedImage], point: IntArray, image: IntArray, uv: FloatArray) -> FloatArray:
    """(P, 3) places nearest to the rays of each point, world metres; NaN where fewer than two rays, or only parallel ones, lead there.

    Squared distances are weighted by the focal length over the depth, so that they count in pixels.

    Parameters
    ----------
    point, image : (N,) numbers of the points, from 0 without a gap, and of the images;  uv : (N, 2) measurements, pixels
    """
    count = int(point.max(initial=-1)) + 1
    directions, origins, focal = np.empty((len(uv), 3)), np.empty((len(uv), 3)), np.empty(len(uv))
    for k in np.unique(image).tolist():
        own, at = np.flatnonzero(image == k), images[k]
        rays = at.rays(uv[own])
        directions[own] = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        origins[own], focal[own] = at.centre, at.camera.fx
    local = origins.mean(axis=0) if len(origins) else np.zeros(3)
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    found, weight = np.full((count, 3), np.nan), np.ones(len(uv))
    for _ in range(2):
        normal, right = np.zeros((count, 3, 3)), np.zeros((count, 3))
        np.add.at(normal, point, weight[:, None, None] * across)
        np.add.at(right, point, weight[:, None] * np.einsum("nij,nj->ni", across, origins - local))
        eigen = np.linalg.eigvalsh(normal)
        # parallel rays leave one direction open; a thousandth of a thousandth of the greatest eigenvalue is an angle of 0.1 degrees
        good = eigen[:, 0] > 1e-6 * np.maximum(eigen[:, 2], 1e-300)
        found[good] = np.linalg.solve(normal[good], right[good][..., None])[..., 0]
        depth = np.linalg.norm(found[point] - (origins - local), axis=1)
        weight = np.where(np.isfinite(depth), (focal / np.maximum(depth, 1e-9)) ** 2, 0.0)
    return found + local
