"""Neighbouring points of different planes: places where the outline may have to be cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, QhullError, cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

THIN_CELL = 0.25
"""Border detection keeps one point per plane and square of this size (m), so that dense clouds cost little more; set by hand."""


@dataclass(frozen=True, slots=True)
class Borders:
    """Pairs of near points of different planes, each the nearest of its kind.

    Attributes
    ----------
    planes : (K, 2) int64, first < second
    first, second : (K, 2) float64, plan positions of the points on the first and second plane
    """

    planes: IntArray
    first: FloatArray
    second: FloatArray

    @property
    def middle(self) -> FloatArray:
        return (self.first + self.second) / 2

    def take(self, chosen: BoolArray) -> Borders:
        return Borders(self.planes[chosen], self.first[chosen], self.second[chosen])

    def __len__(self) -> int:
        return len(self.planes)


def find_borders(segments: PlaneSegments, reach: float, gap: float) -> Borders:
    """Where points of different planes are neighbours.

    Points nearer than `reach` (m) are; across stretches without planes those are that a Delaunay edge no longer than
    `gap` (m) joins.
    """
    on_plane = segments.labels >= 0
    xy, labels = _thinned(segments.points[on_plane, :2], segments.labels[on_plane])
    pairs = np.concatenate([_near_pairs(xy, reach), _delaunay_pairs(xy)])
    one, other = labels[pairs[:, 0]], labels[pairs[:, 1]]
    pairs = pairs[one != other]
    distance = np.hypot(*(xy[pairs[:, 0]] - xy[pairs[:, 1]]).T)
    near = distance <= max(reach, gap)
    pairs, distance = np.concatenate([pairs[near], pairs[near, ::-1]]), np.tile(distance[near], 2)
    order = np.lexsort((pairs[:, 1], distance, labels[pairs[:, 1]], pairs[:, 0]))
    pairs = pairs[order]
    key = pairs[:, 0] * (labels.max(initial=0) + 1) + labels[pairs[:, 1]]
    pairs = pairs[np.unique(key, return_index=True)[1]]
    swap = labels[pairs[:, 0]] > labels[pairs[:, 1]]
    pairs[swap] = pairs[swap, ::-1]
    pairs = unique_pairs(pairs)
    return Borders(labels[pairs], xy[pairs[:, 0]], xy[pairs[:, 1]])


def unique_pairs(pairs: IntArray) -> IntArray:
    """(K, 2) different rows, sorted, of (N, 2) numbers from 0 on."""
    most = pairs.max(initial=0) + 1
    return np.column_stack(np.divmod(np.unique(pairs[:, 0] * most + pairs[:, 1]), most))


def _near_pairs(xy: FloatArray, reach: float) -> IntArray:
    return cKDTree(xy).query_pairs(reach, output_type="ndarray").astype(np.int64).reshape(-1, 2)


def _delaunay_pairs(xy: FloatArray) -> IntArray:
    """(K, 2) ends of the triangles' edges, most of them twice."""
    if len(xy) < 4 or np.ptp(xy, axis=0).min() == 0:
        return np.empty((0, 2), np.int64)
    try:
        triangles = Delaunay(xy).simplices.astype(np.int64)
    except QhullError:  # all points on one line
        return np.empty((0, 2), np.int64)
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])


def _thinned(xy: FloatArray, labels: IntArray) -> tuple[FloatArray, IntArray]:
    square = np.floor(xy / THIN_CELL).astype(np.int64)
    square -= square.min(axis=0, initial=0)
    key = (square[:, 0] * (square[:, 1].max(initial=0) + 1) + square[:, 1]) * (labels.max(initial=0) + 1) + labels
    kept = np.sort(np.unique(key, return_index=True)[1])
    return xy[kept], labels[kept]


def stretches(along: FloatArray, gap: float) -> list[tuple[float, float]]:
    """Start and end of the runs of positions without a gap."""
    if len(along) < 3:
        return []
    ordered = np.sort(along)
    breaks = np.flatnonzero(np.diff(ordered) > gap)
    starts, ends = np.r_[0, breaks + 1], np.r_[breaks, len(ordered) - 1]
    return [(float(ordered[s]), float(ordered[e])) for s, e in zip(starts, ends, strict=True) if e - s >= 2]
