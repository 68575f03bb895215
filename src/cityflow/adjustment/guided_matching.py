"""Matches between the points of two images whose poses are known roughly.

What shows the same place must lie near the epipolar line, and on it between the heights of ground and roofs. So few points are compared, and the ratio
of the best to the second best (Lowe 2004) is taken among those alone.
"""

from __future__ import annotations

import numpy as np

from cityflow.adjustment.descriptor_matching import FAR, SAME_PX, MatchingParameters
from cityflow.adjustment.features import Features
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.kernels import njit

SCALE_FACTOR = 2.0
"""Largest ratio of the sizes of two points, once distances are allowed for: an octave of SIFT up or down."""
NEAREST = 3
"""Points that are kept for each: the best, one that may be the same place, and then a rival."""


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
    order = np.argsort(there[:, 0], kind="stable")
    best_forth, best_back = _nearest(
        (starts * focal, ends * focal, first.scale * scale), (there[order], second.scale[order].astype(np.float64)),
        (first.descriptors, second.descriptors[order]), (_lengths(first), _lengths(second)[order]), (order, second.uv), bound_px,
        (parameters.distance**2, parameters.ratio**2),
    )  # fmt: skip
    chosen = np.flatnonzero(best_forth >= 0)
    chosen = chosen[best_back[best_forth[chosen]] == chosen]
    return np.column_stack([chosen, best_forth[chosen]])


def _lengths(features: Features) -> FloatArray:
    """(N,) of the descriptors."""
    values = features.descriptors.astype(np.float64)
    return np.asarray(np.maximum(np.sqrt(np.einsum("nk,nk->n", values, values)), 1e-6))


@njit(cache=True, nogil=True)
def _nearest(segments, points, descriptors, lengths, numbers, bound, limits):  # type: ignore[no-untyped-def]
    """For each point of the first image the best of the second where it is clearly better than any at another place, else -1; for each of the second the
    best of the first, or -1.

    Those of the second are sorted from left to right, so that few are looked at; `numbers` are their own numbers, and image coordinates by these.
    """
    (starts, ends, scale), (place, size), (ours, theirs), (own, other) = segments, points, descriptors, lengths
    number, uv = numbers
    forth, back = np.full(len(scale), -1, np.int64), np.full(len(size), -1, np.int64)
    least = np.full(len(size), FAR)
    found, at = np.empty(NEAREST), np.empty(NEAREST, np.int64)
    for i in range(len(scale)):
        x, y = starts[i]
        way_x, way_y = ends[i, 0] - x, ends[i, 1] - y
        if not (np.isfinite(way_x) and np.isfinite(way_y) and np.isfinite(scale[i])):
            continue
        length = max(np.sqrt(way_x * way_x + way_y * way_y), 1e-9)
        way_x, way_y = way_x / length, way_y / length
        # a little more than needed: the exact limits come below
        reach = bound * (abs(way_x) + abs(way_y)) + 1.0
        begin = np.searchsorted(place[:, 0], min(x, ends[i, 0]) - reach)
        found[:], at[:] = FAR, -1
        for j in range(begin, len(size)):
            if place[j, 0] > max(x, ends[i, 0]) + reach:
                break
            d_x, d_y, ratio = place[j, 0] - x, place[j, 1] - y, size[j] / scale[i]
            along, across = way_x * d_x + way_y * d_y, way_x * d_y - way_y * d_x
            if not (abs(across) < bound and along > -bound and along < length + bound):
                continue
            if not (ratio < SCALE_FACTOR and ratio > 1 / SCALE_FACTOR):
                continue
            apart, k = 2.0 - 2.0 * _product(ours[i], theirs[j]) / (own[i] * other[j]), number[j]
            if apart < least[k]:
                least[k], back[k] = apart, i
            _insert(found, at, apart, k)
        forth[i] = _distinct(found, at, uv, limits)
    return forth, back


@njit(cache=True, nogil=True)
def _product(a, b):  # type: ignore[no-untyped-def]
    """Of two descriptors: a sum of whole numbers, so the same in any order."""
    total = np.int32(0)
    for k in range(len(a)):
        total += np.int32(a[k]) * np.int32(b[k])
    return total


@njit(cache=True, nogil=True)
def _insert(found, at, apart, number):  # type: ignore[no-untyped-def]
    """Among the nearest, by distance and then by number."""
    m = len(found)
    while m > 0 and (apart < found[m - 1] or (apart == found[m - 1] and number < at[m - 1])):
        m -= 1
    for k in range(len(found) - 1, m, -1):
        found[k], at[k] = found[k - 1], at[k - 1]
    if m < len(found):
        found[m], at[m] = apart, number


@njit(cache=True, nogil=True)
def _distinct(found, at, uv, limits):  # type: ignore[no-untyped-def]
    """The best of the nearest where it is clearly better than any at another place, else -1."""
    rival = found[1]
    if at[1] >= 0:
        x, y = uv[at[1], 0] - uv[at[0], 0], uv[at[1], 1] - uv[at[0], 1]
        # the same place described twice is no rival
        if np.sqrt(x * x + y * y) < SAME_PX:
            rival = found[2]
    return at[0] if found[0] < limits[0] and found[0] < limits[1] * rival else -1


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
