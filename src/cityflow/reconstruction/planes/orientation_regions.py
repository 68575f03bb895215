"""Buckets of the orientation histogram, and connected regions of one bucket (Gross 2005, section 3)."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.planes.local_orientation import FLAWED, LocalOrientation
from cityflow.reconstruction.planes.plane_fit import distances, fit_iterated, solve_plane
from cityflow.reconstruction.planes.roof_cloud import RoofCloud

NONE = -1
"""Bucket of points that have no local plane, or one as steep as a wall: they begin and join no region."""

Weighting = Literal["gradient", "count", "off"]


def orientation_buckets(
    local: LocalOrientation, slopes: tuple[float, float], bin_deg: float, weighting: Weighting = "gradient"
) -> tuple[IntArray, FloatArray]:
    """Bucket of each point: a hill of the histogram of gradient directions, weighted by gradient magnitude.

    Level points, whose gradient tells no direction, are a bucket of their own. Its weight is what its points would
    have at the steepest slope that still counts as level, so that it can be compared with the hills.

    Parameters
    ----------
    local : local planes of the points
    slopes : rise over run below which a point is level, and above which it is a wall
    bin_deg : width of a bin, degrees
    weighting : a point's share in the histogram: magnitude of its gradient, or one; ``off``: one bucket for all

    Returns
    -------
    bucket : (N,) int64, strongest bucket first, `NONE` for points without a usable plane
    weight : (B,) float64, weight of each bucket, descending
    """
    level_slope, max_slope = slopes
    usable = (local.roughness < FLAWED) & (local.slope <= max_slope)
    if weighting == "off":
        return np.where(usable, 0, NONE).astype(np.int64), np.array([float(np.count_nonzero(usable))])
    share = local.slope if weighting == "gradient" else np.ones(len(local.slope))
    level = usable & (local.slope <= level_slope)
    inclined = usable & ~level
    bins = round(360 / bin_deg)
    index = (local.aspect_deg / bin_deg).astype(np.int64) % bins
    histogram = np.bincount(index[inclined], weights=share[inclined], minlength=bins).astype(float)
    hill = _hills(_smoothed(histogram))
    of_level = np.count_nonzero(level) * (level_slope if weighting == "gradient" else 1.0)
    weight = np.append(np.bincount(hill, weights=histogram), of_level).astype(float)
    bucket = np.where(level, len(weight) - 1, hill[index])
    rank = np.empty(len(weight), np.int64)
    rank[np.argsort(-weight, kind="stable")] = np.arange(len(weight))
    return np.where(usable, rank[bucket], NONE).astype(np.int64), np.sort(weight)[::-1]


def _smoothed(histogram: FloatArray) -> FloatArray:
    kernel = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9
    return np.asarray(sum(k * np.roll(histogram, s) for k, s in zip(kernel, range(-2, 3), strict=True)))


def _hills(histogram: FloatArray) -> IntArray:
    """Hill of each bin: the local maximum that steepest ascent leads to, numbered in order of bins."""
    bins = len(histogram)
    around = np.stack([np.roll(histogram, 1), histogram + 1e-12, np.roll(histogram, -1)])
    target = (np.arange(bins) + np.argmax(around, axis=0) - 1) % bins
    for _ in range(bins.bit_length()):
        target = target[target]
    return np.unique(target, return_inverse=True)[1].astype(np.int64)


def seed_order(local: LocalOrientation, bucket: IntArray, max_roughness: float) -> IntArray:
    """Smooth points, those of the heaviest bucket first (buckets are numbered by weight), smoothest first within it."""
    seeds = np.flatnonzero((local.roughness < max_roughness) & (bucket != NONE))
    return seeds[np.lexsort((local.roughness[seeds], bucket[seeds]))].astype(np.int64)


class RegionRule(NamedTuple):
    """What makes a region.

    Attributes
    ----------
    tolerance : metres across the plane
    cosine : least, of the angle between a point's local plane and the region's
    min_points, max_regions : fewest points of a region, most regions
    """

    tolerance: float
    cosine: float
    min_points: int
    max_regions: int


class _Cells(NamedTuple):
    """As in `RoofCloud`; cols: of the raster."""

    points: FloatArray
    starts: IntArray
    cell_of: IntArray
    cols: int


def connected_regions(
    cloud: RoofCloud,
    local: LocalOrientation,
    bucket: IntArray,
    seeds: IntArray,
    rule: RegionRule,
) -> tuple[IntArray, FloatArray]:
    """Unite connected points (3×3 cells) of one bucket that lie on one plane and look its way.

    Parameters
    ----------
    cloud, local, bucket, seeds : points with their local planes, buckets, and where to begin

    Returns
    -------
    labels : (N,) int64, region of each point, -1 for none
    planes : (P, 3) float64, robustly fitted
    """
    return _grow(_Cells(cloud.points, cloud.starts, cloud.cell_of, cloud.shape[1]), local.planes, bucket, seeds, rule)


@njit(cache=True, nogil=True)
def _cosine(p: FloatArray, q: FloatArray) -> float:
    """Between the normals of two planes."""
    dot = p[0] * q[0] + p[1] * q[1] + 1
    return dot / np.sqrt((p[0] ** 2 + p[1] ** 2 + 1) * (q[0] ** 2 + q[1] ** 2 + 1))


@njit(cache=True, nogil=True)
def _grow(
    cells: _Cells, planes: FloatArray, bucket: IntArray, seeds: IntArray, rule: RegionRule
) -> tuple[IntArray, FloatArray]:
    points, starts, cell_of, cols = cells
    tolerance, cos_limit, min_points, max_regions = rule
    n = len(points)
    labels = np.full(n, -1, np.int64)
    found = np.empty((max_regions, 3))
    count = 0
    queue = np.empty(n, np.int64)
    for seed in seeds:
        if count == max_regions:
            break
        if labels[seed] != -1:
            continue
        plane, size, head, refit_at = planes[seed].copy(), 1, 0, 6
        queue[0], labels[seed] = seed, count
        while head < size:
            i = queue[head]
            head += 1
            for row in range(-1, 2):
                first = cell_of[i] + row * cols - 1
                for j in range(starts[first], starts[first + 3]):
                    if labels[j] != -1 or bucket[j] != bucket[seed]:
                        continue
                    off = abs(points[j, 2] - plane[0] * points[j, 0] - plane[1] * points[j, 1] - plane[2])
                    if off > tolerance * np.sqrt(1 + plane[0] ** 2 + plane[1] ** 2):
                        continue
                    if _cosine(planes[j], plane) < cos_limit:
                        continue
                    labels[j] = count
                    queue[size] = j
                    size += 1
            if size >= refit_at:
                a, b, c, sound = solve_plane(points, queue[:size])
                if sound:
                    plane = np.array([a, b, c])
                refit_at = size + max(6, size // 2)
        member = queue[:size].copy()
        plane, sound = fit_iterated(points, member, plane, tolerance / 2, 8)
        kept = 0
        if sound:
            off_plane = distances(points, member, plane)
            for k in range(size):
                if abs(off_plane[k]) > tolerance:
                    labels[member[k]] = -1
                else:
                    kept += 1
        if kept < min_points:
            for k in range(size):
                labels[member[k]] = -1
            continue
        found[count] = plane
        count += 1
    return labels, found[:count].copy()
