"""Matches between the points of two images whose poses are known roughly.

What shows the same place must lie near the epipolar line, and on it between the heights of ground and roofs. So few points are compared, and the ratio
of the best to the second best (Lowe 2004) is taken among those alone.
"""

from __future__ import annotations

import numpy as np

from cityflow.adjustment.descriptor_matching import MatchingParameters, mutual_matches
from cityflow.adjustment.features import Features
from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage

SCALE_FACTOR = 2.0
"""Largest ratio of the sizes of two points, once distances are allowed for: an octave of SIFT up or down."""


def guided_matches(
    images: tuple[OrientedImage, OrientedImage],
    features: tuple[Features, Features],
    heights: tuple[float, float],
    bound_px: float,
    parameters: MatchingParameters,
) -> IntArray:
    """(K, 2) numbers of points of the first and second image that match, each at most once; ascending by the first.

    Parameters
    ----------
    heights : lowest ground and highest object that both may show, world metres
    bound_px : how far a match may lie from where the poses have it, pixels of the second image
    """
    first, second = features
    if not len(first) or not len(second):
        return np.empty((0, 2), np.int64)
    starts, ends, scale = _segments(images, first, heights)
    focal = float(np.sqrt(images[1].camera.fx * images[1].camera.fy))
    there = images[1].camera.undistort(second.uv) * focal
    starts, ends = starts * focal, ends * focal

    def comparable(rows: slice) -> BoolArray:
        near = _near(starts[rows], ends[rows], there, bound_px)
        size = second.scale[None, :] / (first.scale[rows] * scale[rows])[:, None]
        return np.asarray(near & (size < SCALE_FACTOR) & (size > 1 / SCALE_FACTOR))

    return mutual_matches(first, second, parameters, comparable)


def _segments(
    images: tuple[OrientedImage, OrientedImage], first: Features, heights: tuple[float, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where each ray of the first image runs in the second between two heights: (N, 2) x/z, y/z at both, NaN where behind it; (N,) ratio of sizes."""
    one, other = images
    rays = one.rays(first.uv)
    down = np.where(rays[:, 2] < -1e-6, rays[:, 2], np.nan)
    ends, depths = [], []
    for height in heights:
        depth = (height - one.centre[2]) / down
        local = other.in_camera(one.centre + depth[:, None] * rays)
        ends.append(local[:, :2] / np.where(local[:, 2] > 1e-6, local[:, 2], np.nan)[:, None])
        depths.append(depth / local[:, 2])
    focals = np.sqrt(other.camera.fx * other.camera.fy / (one.camera.fx * one.camera.fy))
    return ends[0], ends[1], focals * depths[0]


def _near(starts: FloatArray, ends: FloatArray, points: FloatArray, bound: float) -> np.ndarray:
    """(N, M) which points lie within `bound` of which segments."""
    way = ends - starts
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    way = way / length[:, None]
    along = way @ points.T - np.sum(way * starts, axis=1)[:, None]
    normal = np.column_stack([-way[:, 1], way[:, 0]])
    across = normal @ points.T - np.sum(normal * starts, axis=1)[:, None]
    return np.asarray((np.abs(across) < bound) & (along > -bound) & (along < length[:, None] + bound))
