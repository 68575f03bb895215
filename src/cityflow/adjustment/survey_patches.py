"""Plane patches of a scan that pictures can be compared on, and which projection centres see them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from scipy.spatial import cKDTree

from cityflow.adjustment.point_to_plane import STEEP, planes_of
from cityflow.core.arrays import BoolArray, FloatArray, IntArray

UPRIGHT = 0.3
"""Planes whose normal rises by less than this are walls; set by hand, as are those below."""
LEVEL_APART_M = 4.0
"""Distance of level patches; others lie one edge apart."""
WALL_REACH = 2.0
"""A wall's plane is fitted to points within this many half edges: a scan from above has few."""
NEAR_M, THICKEST_M, LEAST_POINTS = 0.15, 0.08, 8
"""Points so near belong to a plane; it is at most so thick (root mean square), and has so many points at least."""
STEP_M, HIGH_M, MOST_BESIDE = 0.2, 1.5, 0.05
"""Points of a patch so far off its plane, but not farther, are a step, and no patch has more of them than this share."""
MOST_PATCHES = 400
"""Of each kind; of more, every n-th; bounds time."""
CELL_M, RISE_M, MARCH_M, CLEAR_M = 0.5, 0.3, 0.4, 1.0
"""A ray is hidden where a cell of the scan is higher than it by `RISE_M`; looked at in such steps, and from that distance on."""
MOST_SLANTED = float(np.cos(np.radians(65.0)))


class Kind(IntEnum):
    """What a patch says: level ones of height and tilt, walls of the place in plan alone."""

    LEVEL, SLOPING, WALL = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Patches:
    """Squares of the scan's planes: (N, 3) middles, metres, (N, 3) unit normals (upwards, those of walls to either side), (N,) `Kind`."""

    xyz: FloatArray
    normals: FloatArray
    kind: IntArray

    @classmethod
    def none(cls) -> Patches:
        """No patch."""
        return cls(np.empty((0, 3)), np.empty((0, 3)), np.empty(0, np.int64))


def patches_of(reference: FloatArray, about: FloatArray, reach_m: float, edge_m: float) -> Patches:
    """Patches of (M, 3) points of a scan within `reach_m` of (K, 3) places, in an order of their own.

    Parameters
    ----------
    edge_m : of the squares, metres
    """
    planes = planes_of(reference, about, reach_m)
    normals = planes.normals * np.where(planes.normals[:, 2:] < 0, -1.0, 1.0)
    wall, level = _kinds(normals)
    tree, found = cKDTree(reference), []
    for group, apart in ((level, LEVEL_APART_M), (~level & ~wall, edge_m), (wall, edge_m)):
        rows = np.flatnonzero(group)
        first = np.unique(np.floor(planes.xyz[rows] / apart), axis=0, return_index=True)[1]
        rows = rows[np.sort(first)]
        rows = rows[:: max(1, -(-len(rows) // MOST_PATCHES))]
        found += [_fitted(reference, tree, planes.xyz[k], normals[k], edge_m) for k in rows]
    kept = [each for each in found if each is not None]
    if not kept:
        return Patches.none()
    xyz, normal = np.array([k[0] for k in kept]), np.array([k[1] for k in kept])
    wall, level = _kinds(normal)
    normal[level] = (0.0, 0.0, 1.0)
    return Patches(xyz, normal, np.where(wall, Kind.WALL, np.where(level, Kind.LEVEL, Kind.SLOPING)).astype(np.int64))


def axes_of(normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors of a plane."""
    along = np.cross(normal, (0.0, 0.0, 1.0) if abs(normal[2]) < 0.9 else (1.0, 0.0, 0.0))
    along = along / np.linalg.norm(along)
    return along, np.cross(normal, along)


class Heights:
    """The highest point of a scan in each cell, as what hides patches from projection centres."""

    def __init__(self, reference: FloatArray) -> None:
        self._low = reference[:, :2].min(axis=0) - CELL_M
        cell = np.floor((reference[:, :2] - self._low) / CELL_M).astype(np.int64)
        self._top = np.full(cell.max(axis=0) + 2, -np.inf)
        np.maximum.at(self._top, (cell[:, 0], cell[:, 1]), reference[:, 2])
        self._highest = float(reference[:, 2].max())

    def sees(self, place: FloatArray, normal: FloatArray, centres: FloatArray) -> BoolArray:
        """(N,) which of (N, 3) projection centres see the front of a patch, not too slanted."""
        ray = centres - place
        ray = ray / np.linalg.norm(ray, axis=1, keepdims=True)
        seen = ray @ normal >= MOST_SLANTED
        for k in np.flatnonzero(seen):
            far = min((self._highest - place[2]) / max(ray[k, 2], 0.05), 150.0)
            way = place + RISE_M * normal + np.arange(CLEAR_M, max(far, CLEAR_M) + MARCH_M, MARCH_M)[:, None] * ray[k]
            cell = np.floor((way[:, :2] - self._low) / CELL_M).astype(np.int64)
            inside = ((cell >= 0) & (cell < self._top.shape)).all(axis=1)
            seen[k] = not (self._top[cell[inside, 0], cell[inside, 1]] > way[inside, 2] + RISE_M).any()
        return np.asarray(seen)


def _kinds(normals: FloatArray) -> tuple[BoolArray, BoolArray]:
    """(N,) which are walls, and which are level."""
    return np.abs(normals[:, 2]) < UPRIGHT, np.hypot(normals[:, 0], normals[:, 1]) < STEEP


def _fitted(
    reference: FloatArray, tree: cKDTree, place: FloatArray, normal: FloatArray, edge_m: float
) -> tuple[FloatArray, FloatArray] | None:
    """A patch's plane, fitted to all points in its square; None where these do not fill it, or steps stand in it."""
    wall = abs(normal[2]) < UPRIGHT
    half = edge_m / 2 * (WALL_REACH if wall else 1.0)
    near = reference[np.sort(np.asarray(tree.query_ball_point(place, 1.5 * half), np.int64))]
    for _ in range(2):
        if wall:
            normal = np.array([normal[0], normal[1], 0.0]) / np.hypot(normal[0], normal[1])
        own = near[_in_square(near - place, normal, half) & (np.abs((near - place) @ normal) < NEAR_M)]
        if len(own) < LEAST_POINTS:
            return None
        middle = own.mean(axis=0)
        if wall:
            fresh = np.array([*np.linalg.svd((own - middle)[:, :2], full_matrices=False)[2][1], 0.0])
        else:
            fresh = np.linalg.svd(own - middle, full_matrices=False)[2][2]
        normal = fresh * (-1.0 if fresh @ normal < 0 else 1.0)
        place = place + ((middle - place) @ normal) * normal
    off = (near - place) @ normal
    square = _in_square(near - place, normal, half)
    on = square & (np.abs(off) < NEAR_M)
    if on.sum() < LEAST_POINTS or np.sqrt(np.mean(off[on] ** 2)) > THICKEST_M:
        return None
    if not wall:
        along, across = axes_of(normal)
        quarter = 2 * ((near - place)[on] @ along > 0) + ((near - place)[on] @ across > 0)
        beside = square & (np.abs(off) > STEP_M) & (np.abs(off) < HIGH_M)
        if np.bincount(quarter, minlength=4).min() < 1 or beside.sum() > MOST_BESIDE * on.sum():
            return None
    return place, np.asarray(normal if normal[2] >= 0 else -normal)


def _in_square(off: FloatArray, normal: FloatArray, half: float) -> BoolArray:
    along, across = axes_of(normal)
    return np.asarray((np.abs(off @ along) < half) & (np.abs(off @ across) < half))
