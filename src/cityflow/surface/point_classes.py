"""Classes of points: by the class of the surface and their height over the terrain."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.ndimage import minimum_filter
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.core.points import BRIDGE, BUILDING, GROUND, HIGH_NOISE, HIGH_VEGETATION, LOW_NOISE, UNCLASSIFIED, WATER
from cityflow.surface.image_rasters import ImageSurface

NEAR_M = 0.75
"""A wall's points stand up to this far beside the building's cells: an overhang and a cell; set by hand, as are those below."""
LOW_M = 0.4
"""Ground reaches this far above and below the terrain."""
BELOW_M = 2.0
"""What lies deeper than this below the terrain is no surface, nor is a cluster that floats higher than this above the surface."""
GAP_M = 1.0
"""Points in boxes of this edge that touch are one cluster: sparse crowns hold together, and a floating cluster stays apart from them."""


def classify_points(points: ImagePoints, surface: ImageSurface) -> ByteArray:
    """(N,) LAS class of each point: 2 ground, 5 high vegetation, 6 building with its walls, 7 far below the terrain, 9 water, 17 bridge,
    18 in a cluster that floats above the surface, else 1.

    `points` in the world, inside the surface's core; points outside are 1.
    """
    grid = surface.fine.grid
    reach = max(round(NEAR_M / grid.cell), 1)
    place = (grid.x_min, grid.y_max, grid.cell)
    found = np.asarray(
        _classes(points.xyz, surface.fine.klass, surface.fine.dtm, surface.fine.dsm_filled, place, reach)
    )
    found[is_floating(points.xyz, surface.fine.dsm_filled, grid)] = HIGH_NOISE
    return found


def is_floating(xyz: FloatArray, dsm: Float32Array, grid: Grid) -> BoolArray:
    """(N,) points in clusters that lie higher than `BELOW_M` above the surface with all their points.

    The surface has taken up none of them, so they are no mast that stands on a roof and no crown. Clusters at the edge of `grid`, or above cells that have
    no height, may belong to what is not seen here: they do not count.

    Parameters
    ----------
    xyz : (N, 3) world metres
    dsm : (rows, cols) surface over `grid` without small holes, metres; NaN where it is not known
    """
    if len(xyz) == 0:
        return np.zeros(0, np.bool_)
    column, high, first, last_column = _columns(xyz, dsm, (grid.x_min, grid.y_max, grid.cell, grid.bounds[1]))
    found = np.zeros(len(xyz), np.bool_)
    if not high.any():
        return found
    lowest = np.full((last_column[0] - first[0] + 1, last_column[1] - first[1] + 1), np.inf)
    _lower(xyz, column, high, first, lowest)
    lowest = minimum_filter(lowest, 3, mode="constant", cval=np.inf)
    # what lies deeper than a box below all high points around touches none of them
    near = np.flatnonzero(_above(xyz, column, first, lowest))
    high, place = high[near], xyz[near]
    box = np.column_stack([column[near], np.floor(place[:, 2] / GAP_M).astype(np.int64)])
    last = np.floor(np.array([grid.cols, grid.rows]) * grid.cell / GAP_M - 1e-9)
    stands = ~high | (box[:, :2] <= 0).any(axis=1) | (box[:, :2] >= last).any(axis=1)
    box -= box.min(axis=0) - 1
    sides = box.max(axis=0) + 2
    keys, own = np.unique(np.ravel_multi_index(tuple(box.T), tuple(sides)), return_inverse=True)
    cluster = _clusters(keys, sides)[own]
    is_afloat = np.ones(len(keys), np.bool_)
    is_afloat[cluster[stands]] = False
    found[near] = is_afloat[cluster]
    return found


@njit(cache=True, nogil=True)
def _columns(xyz, dsm, place):  # type: ignore[no-untyped-def]
    """(N, 2) column of boxes of each point; (N,) whether it stands high over the surface; the least and the greatest of the columns."""
    x_min, y_max, cell, y_min = place
    column, high = np.empty((len(xyz), 2), np.int64), np.zeros(len(xyz), np.bool_)
    c_0, r_0, c_1, r_1 = np.int64(2**62), np.int64(2**62), np.int64(-(2**62)), np.int64(-(2**62))
    for i in range(len(xyz)):
        c, r = np.int64(np.floor((xyz[i, 0] - x_min) / GAP_M)), np.int64(np.floor((xyz[i, 1] - y_min) / GAP_M))
        column[i, 0], column[i, 1] = c, r
        c_0, r_0, c_1, r_1 = min(c, c_0), min(r, r_0), max(c, c_1), max(r, r_1)
        row, col = int(np.floor((y_max - xyz[i, 1]) / cell)), int(np.floor((xyz[i, 0] - x_min) / cell))
        if 0 <= row < dsm.shape[0] and 0 <= col < dsm.shape[1]:
            high[i] = xyz[i, 2] - dsm[row, col] > BELOW_M
    return column, high, (c_0, r_0), (c_1, r_1)


@njit(cache=True, nogil=True)
def _lower(xyz, column, high, first, lowest):  # type: ignore[no-untyped-def]
    """Put the lowest of the high points of each column into `lowest`."""
    for i in range(len(xyz)):
        if high[i]:
            c, r = column[i, 0] - first[0], column[i, 1] - first[1]
            lowest[c, r] = min(lowest[c, r], xyz[i, 2])


@njit(cache=True, nogil=True)
def _above(xyz, column, first, lowest):  # type: ignore[no-untyped-def]
    above = np.empty(len(xyz), np.bool_)
    for i in range(len(xyz)):
        above[i] = xyz[i, 2] > lowest[column[i, 0] - first[0], column[i, 1] - first[1]] - 2 * GAP_M
    return above


def _clusters(keys: IntArray, sides: IntArray) -> IntArray:
    """(N,) number of the cluster of each box; those that touch by a face, an edge or a corner are together.

    `keys` are (N,) sorted numbers of boxes in an array of (3,) `sides`, none of them at its border.
    """
    ends = []
    for x, y, z in itertools.product((-1, 0, 1), repeat=3):
        beside = keys + (x * sides[1] + y) * sides[2] + z
        place = np.minimum(np.searchsorted(keys, beside), len(keys) - 1)
        found = np.flatnonzero(keys[place] == beside)
        ends.append(np.stack([found, place[found]]))
    one, other = np.concatenate(ends, axis=1)
    graph = coo_array((np.ones(len(one), np.bool_), (one, other)), (len(keys), len(keys)))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


@njit(cache=True, nogil=True)
def _classes(
    xyz: FloatArray,
    klass: ByteArray,
    dtm: Float32Array,
    dsm: Float32Array,
    place: tuple[float, float, float],
    reach: int,
) -> ByteArray:
    out = np.full(len(xyz), UNCLASSIFIED, np.uint8)
    for i in range(len(xyz)):
        r = int(np.floor((place[1] - xyz[i, 1]) / place[2]))
        c = int(np.floor((xyz[i, 0] - place[0]) / place[2]))
        if r < 0 or c < 0 or r >= klass.shape[0] or c >= klass.shape[1] or np.isnan(dtm[r, c]):
            continue
        over = xyz[i, 2] - dtm[r, c]
        own = klass[r, c]
        if over < -BELOW_M:
            out[i] = LOW_NOISE
        elif own in (WATER, BRIDGE):
            out[i] = own
        elif abs(over) <= LOW_M:
            out[i] = GROUND
        elif over > 0:
            out[i] = _standing(r, c, xyz[i, 2], own, klass, dsm, reach)
    return out


@njit(cache=True, nogil=True)
def _standing(r: int, c: int, z: float, own: int, klass: ByteArray, dsm: Float32Array, reach: int) -> int:
    """What a point above the ground belongs to: its cell's class, or that of the nearest cell beside it that is at least as high."""
    if own in (BUILDING, HIGH_VEGETATION):
        return own
    for ring in range(1, reach + 1):
        house, green = 0, 0
        for i in range(max(r - ring, 0), min(r + ring + 1, klass.shape[0])):
            step = 1 if abs(i - r) == ring else 2 * ring
            for j in range(c - ring, c + ring + 1, step):
                if j < 0 or j >= klass.shape[1] or dsm[i, j] < z - LOW_M:
                    continue
                house += klass[i, j] == BUILDING
                green += klass[i, j] == HIGH_VEGETATION
        if house + green > 0:
            return BUILDING if house >= green else HIGH_VEGETATION
    return UNCLASSIFIED
