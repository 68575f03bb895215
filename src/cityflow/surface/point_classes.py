"""Classes of points: by the class of the surface and their height over the terrain."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.kernels import njit
from cityflow.core.points import BRIDGE, BUILDING, GROUND, HIGH_VEGETATION, LOW_NOISE, UNCLASSIFIED, WATER
from cityflow.surface.image_rasters import ImageSurface

NEAR_M = 0.75
"""A wall's points stand up to this far beside the building's cells: an overhang and a cell; set by hand, as are those below."""
LOW_M = 0.4
"""Ground reaches this far above and below the terrain."""
BELOW_M = 2.0
"""What lies deeper than this below the terrain is no surface."""


def classify_points(points: ImagePoints, surface: ImageSurface) -> ByteArray:
    """(N,) LAS class of each point: 2 ground, 5 high vegetation, 6 building with its walls, 7 far below the terrain, 9 water, 17 bridge, else 1.

    `points` in the world, inside the surface's core; points outside are 1.
    """
    grid = surface.fine.grid
    reach = max(round(NEAR_M / grid.cell), 1)
    place = (grid.x_min, grid.y_max, grid.cell)
    return np.asarray(_classes(points.xyz, surface.fine.klass, surface.fine.dtm, surface.fine.dsm_filled, place, reach))


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
