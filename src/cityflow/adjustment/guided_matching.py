"""Matches between the points of two images whose poses are known roughly.

What shows the same place must lie near the epipolar line, and on it between the heights of ground and roofs. So few points are compared, and the ratio
of the best to the second best (Lowe 2004) is taken among those alone.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.adjustment.features import Features
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import Parameters

ROWS_AT_ONCE = 512
"""Points of the first image that are compared at once; bounds memory."""
FAR = 9.0
"""More than any squared distance of two descriptors of unit length."""


class MatchingParameters(Parameters):
    """What counts as a match."""

    ratio: float = Field(0.8, gt=0.3, le=1, description="largest distance of the best over that of the second best")
    distance: float = Field(0.75, gt=0.1, le=1.4, description="largest distance of descriptors of unit length")
    same_px: float = Field(2.0, ge=0, le=20, description="points nearer than this are one place, pixels")
    scale_factor: float = Field(2.0, ge=1.1, le=8, description="largest ratio of sizes, once distances are allowed for")


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
    best_forth = np.full(len(first), -1, np.int64)
    best_back = np.full(len(second), -1, np.int64)
    least_back = np.full(len(second), FAR)
    theirs = _unit(second)
    for top in range(0, len(first), ROWS_AT_ONCE):
        rows = slice(top, min(top + ROWS_AT_ONCE, len(first)))
        near = _near(starts[rows] * focal, ends[rows] * focal, there, bound_px)
        size = second.scale[None, :] / (first.scale[rows] * scale[rows])[:, None]
        near &= (size < parameters.scale_factor) & (size > 1 / parameters.scale_factor)
        squared = np.where(near, 2.0 - 2.0 * (_unit(first.taken(np.arange(rows.start, rows.stop))) @ theirs.T), FAR)
        best_forth[rows] = _distinct(squared, second.uv, parameters)
        nearest = squared.argmin(axis=0)
        least = squared[nearest, np.arange(len(second))]
        better = least < least_back
        best_back[better], least_back[better] = nearest[better] + top, least[better]
    chosen = np.flatnonzero(best_forth >= 0)
    chosen = chosen[best_back[best_forth[chosen]] == chosen]
    return np.column_stack([chosen, best_forth[chosen]])


def _unit(features: Features) -> np.ndarray:
    values = features.descriptors.astype(np.float32)
    return values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-6)


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


def _distinct(squared: np.ndarray, uv: FloatArray, parameters: MatchingParameters) -> IntArray:
    """(N,) the best point for each row where it is clearly better than any at another place, else -1."""
    rows = np.arange(len(squared))
    best = squared.argmin(axis=1)
    least = squared[rows, best]
    others = squared.copy()
    others[rows, best] = FAR
    second = others.argmin(axis=1)
    # the same place described twice is no rival
    same = np.linalg.norm(uv[second] - uv[best], axis=1) < parameters.same_px
    others[rows[same], second[same]] = FAR
    rival = others.min(axis=1)
    good = (least < parameters.distance**2) & (least < parameters.ratio**2 * rival)
    return np.where(good, best, -1)
