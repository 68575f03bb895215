"""Planes without a place in the partition: location of their points, and cut lines around them.

Lines come from pairs of neighbouring points. Where clutter, walls or gaps part a roof from its neighbours, there are too few of these, and no
cell can be cut out for it. Its own points say where it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.partition.cell_evidence import points_in_cells
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

LEAST_POINTS = 6
"""Twice those of a plane."""
RIM = 0.02
"""Share of a patch's points that may lie beyond each side of its box: neighbours that were taken for its own; set by hand."""


@dataclass(frozen=True, slots=True)
class Patch:
    """Connected points of one plane that the roof over them misses.

    Attributes
    ----------
    plane : index of the plane
    xy : (N, 2) float64, local plan positions of the points, metres
    above : metres, median height of the points above the roof; negative below it
    """

    plane: int
    xy: FloatArray
    above: float


def missed_patches(
    partition: RoofPartition,
    planes: FloatArray,
    segments: PlaneSegments,
    limits: tuple[float, float, float],
) -> list[Patch]:
    """Patches of at least so many points, the largest first.

    Parameters
    ----------
    partition : the roof;  planes : (Q, 3) float64, those that its cells are numbered by
    segments : planes as they were found, with their points
    limits :
        metres, vertically, within which a roof explains a point; fewest points of a patch; metres within which points of one plane are connected
    """
    tolerance, least, reach = limits
    off = _off(partition, planes, segments.points)
    missed = (segments.labels >= 0) & (np.abs(off) > tolerance)
    least, found = max(least, LEAST_POINTS), []
    for plane in np.flatnonzero(np.bincount(segments.labels[missed]) >= least).tolist():
        mine = np.flatnonzero(missed & (segments.labels == plane))
        patch = _connected(segments.points[mine, :2], reach)
        for k in np.flatnonzero(np.bincount(patch) >= least):
            member = mine[patch == k]
            found.append(Patch(plane, segments.points[member, :2], float(np.median(off[member]))))
    return sorted(found, key=lambda p: (-len(p.xy), p.plane, tuple(p.xy[0])))


def _off(partition: RoofPartition, planes: FloatArray, points: FloatArray) -> FloatArray:
    """(N,) heights of points above the plane of their cell, metres; zero outside all cells."""
    division, labels = partition.subdivision()
    numbers = list(division.cells)
    x, y, z = (np.ascontiguousarray(v) for v in points.T)
    cell = points_in_cells(division, numbers, x, y)
    a, b, c = planes[np.array([labels[n] for n in numbers])[cell]].T
    return np.where(cell >= 0, z - a * x - b * y - c, 0.0)


def _connected(xy: FloatArray, reach: float) -> IntArray:
    pairs = cKDTree(xy).query_pairs(reach, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (len(xy), len(xy)))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def lines_around(patch: Patch, directions: Sequence[float], margin: float) -> list[CutLine]:
    """Four sides of the tightest box around a patch, its sides in one of some directions (radians), `margin` (m) outside its points."""
    boxes = [_box(patch.xy, direction) for direction in directions]
    direction, (low, high) = min(
        zip(directions, boxes, strict=True), key=lambda box: float(np.prod(box[1][1] - box[1][0]))
    )
    low, high = low - margin, high + margin
    lines = []
    for axis in (0, 1):
        # a line of offset o on axis 0 has the normal u and runs along v, on axis 1 the other way round
        normal = direction + axis * math.pi / 2
        start, end = (low[1], high[1]) if axis == 0 else (-high[0], -low[0])
        length = float(end - start)
        lines += [
            CutLine(math.cos(normal), math.sin(normal), float(offset), float(start), float(end), length)
            for offset in (low[axis], high[axis])
        ]
    return lines


def _box(xy: FloatArray, direction: float) -> tuple[FloatArray, FloatArray]:
    c, s = math.cos(direction), math.sin(direction)
    own = xy @ np.array([[c, -s], [s, c]])
    low, high = np.quantile(own, (RIM, 1 - RIM), axis=0)
    return low, high
