"""A cloud cut into cubes, and the plane of least squares through each cube's neighbourhood (Frommholz 2017, sections 2 and 3).

The sums that a principal component analysis needs are kept for every cube, so that a neighbourhood of 27 cubes is the sum of
27 rows and no point is visited twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

SUMS = 10
"""Columns of a row of sums: count, sums of x, y, z and of their products."""
COUNT, X, Y, Z, XX, XY, XZ, YY, YZ, ZZ = range(SUMS)
PLANE = 9
"""Columns of a row of a plane: unit normal, centre, standard deviations across, between and along."""
A, B, C, CX, CY, CZ, ACROSS, BETWEEN, ALONG = range(PLANE)


@dataclass(frozen=True, slots=True)
class Cubes:
    """Points sorted by cube.

    Attributes
    ----------
    points : (N, 3) float64, metres, from the corner of the bounding box
    order : (N,) int64, place of each sorted point in the input
    starts : (M + 1,) int64, first point of each occupied cube
    index : (M, 3) int64, column, row and layer of each occupied cube, from 1
    keys : (M,) int64, increasing
    strides : what a step in x and a step in y add to a key
    edge : metres
    corner : (3,) float64, what was subtracted from the input
    """

    points: FloatArray
    order: IntArray
    starts: IntArray
    index: IntArray
    keys: IntArray
    strides: tuple[int, int]
    edge: float
    corner: FloatArray

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def cube_of(self) -> IntArray:
        """(N,) cube of each sorted point."""
        return np.repeat(np.arange(len(self)), np.diff(self.starts))

    @property
    def centres(self) -> FloatArray:
        """(M, 3) metres, in the frame of `points`."""
        return np.asarray((self.index - 0.5) * self.edge)

    def neighbours(self) -> IntArray:
        """(M, 27) occupied cubes around each, itself included; -1 where there is none."""
        return _neighbours(self.keys, *self.strides)

    def sums(self) -> FloatArray:
        """(M, 10) what `plane_of` needs, of each cube alone."""
        return _sums(self.points, self.starts)


def cut_in_cubes(xyz: FloatArray, edge: float) -> Cubes:
    """Cubes of the axis-aligned bounding box.

    Parameters
    ----------
    xyz : (N, 3) float64, metres, finite
    edge : metres
    """
    corner = xyz.min(axis=0) if len(xyz) else np.zeros(3)
    local = xyz - corner
    index = np.floor(local / edge).astype(np.int64) + 1
    size = index.max(axis=0) + 2 if len(xyz) else np.full(3, 3)
    strides = (int(size[1] * size[2]), int(size[2]))
    key = index[:, 0] * strides[0] + index[:, 1] * strides[1] + index[:, 2]
    order = np.argsort(key, kind="stable").astype(np.int64)
    key = key[order]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]]) if len(key) else np.empty(0, np.int64)
    starts = np.r_[first, len(key)].astype(np.int64)
    return Cubes(
        np.ascontiguousarray(local[order]), order, starts, index[order][first], key[first], strides, edge, corner
    )


@njit(cache=True, nogil=True)
def _neighbours(keys: IntArray, step_x: int, step_y: int) -> IntArray:
    table = np.full((len(keys), 27), -1, np.int64)
    for m in range(len(keys)):
        n = 0
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                low = keys[m] + dx * step_x + dy * step_y - 1
                k = np.searchsorted(keys, low)
                while k < len(keys) and keys[k] <= low + 2:
                    table[m, n] = k
                    n += 1
                    k += 1
    return table


@njit(cache=True, nogil=True)
def _sums(points: FloatArray, starts: IntArray) -> FloatArray:
    out = np.zeros((len(starts) - 1, SUMS))
    for m in range(len(out)):
        for i in range(starts[m], starts[m + 1]):
            add_point(out[m], points[i])
    return out


@njit(cache=True, nogil=True)
def add_point(sums: FloatArray, point: FloatArray) -> None:
    """Count one point in a row of sums."""
    x, y, z = point[0], point[1], point[2]
    sums[COUNT] += 1.0
    sums[X] += x
    sums[Y] += y
    sums[Z] += z
    sums[XX] += x * x
    sums[XY] += x * y
    sums[XZ] += x * z
    sums[YY] += y * y
    sums[YZ] += y * z
    sums[ZZ] += z * z


@njit(cache=True, nogil=True)
def plane_of(sums: FloatArray, plane: FloatArray) -> None:
    """Plane of least squares from a row of sums.

    Parameters
    ----------
    sums : (10,)
    plane : (9,) filled with the unit normal, the centre, and the standard deviations across, between and along
    """
    n = sums[COUNT]
    cx, cy, cz = sums[X] / n, sums[Y] / n, sums[Z] / n
    matrix = np.empty((3, 3))
    matrix[0, 0] = sums[XX] / n - cx * cx
    matrix[0, 1] = matrix[1, 0] = sums[XY] / n - cx * cy
    matrix[0, 2] = matrix[2, 0] = sums[XZ] / n - cx * cz
    matrix[1, 1] = sums[YY] / n - cy * cy
    matrix[1, 2] = matrix[2, 1] = sums[YZ] / n - cy * cz
    matrix[2, 2] = sums[ZZ] / n - cz * cz
    values, vectors = np.linalg.eigh(matrix)
    sign = 1.0 if vectors[2, 0] >= 0 else -1.0
    for k in range(3):
        plane[k] = sign * vectors[k, 0]
        plane[ACROSS + k] = np.sqrt(max(values[k], 0.0))
    plane[CX], plane[CY], plane[CZ] = cx, cy, cz
