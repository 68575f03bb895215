"""Level roofs among points without a usable local plane: peaks of their heights.

A low roof under foliage or beside scattered echoes of a wall, and a roof of few points, has no smooth 3×3 neighbourhood to
begin a region from. But its points share one height, which neither leaves nor a wall do: their heights spread over metres.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.planes.roof_cloud import RoofCloud

REACH_M = 1.0
"""Points so far below and above a level are what it must stand out from; set by hand, as are those below."""
CONTRAST = 3.0
"""How many times more points a level must have than a layer of equal thickness near it, if they were spread evenly."""


def level_regions(
    cloud: RoofCloud, left: IntArray, half_band: float, min_points: int, most: int
) -> tuple[IntArray, FloatArray]:
    """Connected points of one height, those of the fullest heights first.

    Every band of heights is looked at, and every patch of points in it that stands out from the other points above and below the same cells.

    Parameters
    ----------
    cloud : all points of the unit
    left : (N,) bool, points that are searched
    half_band : metres below and above a level that its points take
    min_points : fewest points of a level
    most : most levels

    Returns
    -------
    labels : (N,) int64, level of each point, -1 for none
    planes : (P, 3) float64, level
    """
    labels = np.full(len(left), -1, np.int64)
    planes: list[list[float]] = []
    open_ = np.flatnonzero(left)
    while len(open_) >= min_points and len(planes) < most:
        chosen = _fullest_band(cloud.points[open_, 2], half_band)
        if len(chosen) < min_points:
            break
        for member in _patches_of(cloud, open_[chosen], min_points)[: most - len(planes)]:
            if _stands_out(cloud, np.flatnonzero(left), member, half_band):
                labels[member] = len(planes)
                planes.append([0.0, 0.0, float(np.median(cloud.points[member, 2]))])
        # the whole band is done with, whatever was in it: the next height must be another one
        open_ = np.delete(open_, chosen)
    return labels, np.array(planes).reshape(-1, 3)


def _fullest_band(z: FloatArray, half_band: float) -> IntArray:
    """Points of the band with most points, in the order of their heights."""
    order = np.argsort(z, kind="stable")
    last = np.searchsorted(z[order], z[order] + 2 * half_band, side="right")
    k = int(np.argmax(last - np.arange(len(z))))
    return order[k : last[k]]


def _patches_of(cloud: RoofCloud, chosen: IntArray, min_points: int) -> list[IntArray]:
    """Sets of points connected over 3×3 cells, the largest first, each in ascending order."""
    points = np.sort(chosen)
    patch = _patches(cloud.starts, cloud.cell_of, cloud.shape[1], points)
    size = np.bincount(patch)
    return [points[patch == k] for k in np.argsort(-size, kind="stable") if size[k] >= min_points]


def _stands_out(cloud: RoofCloud, searched: IntArray, member: IntArray, half_band: float) -> bool:
    """Whether a patch has more points than a layer as thick would have of those above and below it, were they spread evenly."""
    here = searched[np.isin(cloud.cell_of[searched], cloud.cell_of[member])]
    near = np.abs(cloud.points[here, 2] - np.median(cloud.points[member, 2])) <= REACH_M
    even = (np.count_nonzero(near) - len(member)) * half_band / max(REACH_M - half_band, half_band)
    return bool(len(member) >= CONTRAST * even)


@njit(cache=True, nogil=True)
def _patches(starts: IntArray, cell_of: IntArray, cols: int, chosen: IntArray) -> IntArray:
    patch = np.full(starts[-1], -2, np.int64)
    for i in chosen:
        patch[i] = -1
    queue, count = np.empty(len(chosen), np.int64), 0
    for seed in chosen:
        if patch[seed] != -1:
            continue
        queue[0], patch[seed], head, size = seed, count, 0, 1
        while head < size:
            i = queue[head]
            head += 1
            for row in range(-1, 2):
                first = cell_of[i] + row * cols - 1
                for j in range(starts[first], starts[first + 3]):
                    if patch[j] == -1:
                        patch[j] = count
                        queue[size] = j
                        size += 1
        count += 1
    return patch[chosen]
