"""Surfaces of any slope: cubes side by side whose points lie on one plane (Frommholz 2017, section 3).

The normal alone would join a roof and the one a step below it, so that a cube joins a surface only where its own points
lie on the plane of all cubes that joined before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.noise.cubes import (
    ACROSS,
    BETWEEN,
    COUNT,
    CX,
    CY,
    CZ,
    SUMS,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZZ,
    A,
    B,
    C,
    Cubes,
    X,
    Y,
    Z,
    plane_of,
)

LEAST = 6
"""Points that a cube needs for a plane of its own; with fewer, those of its 26 neighbours count, too; set by hand."""


@dataclass(frozen=True, slots=True)
class CubeRegions:
    """Surfaces in a cloud cut into cubes, those with most points first.

    Attributes
    ----------
    cubes : the cloud
    labels : (M,) int64, surface of each cube, -1 for none
    planes : (R, 9) float64: unit normal (z >= 0), centre, standard deviations across, between and along; frame of `cubes.points`
    counts : (R,) int64, points of each
    """

    cubes: Cubes
    labels: IntArray
    planes: FloatArray
    counts: IntArray

    def __len__(self) -> int:
        return len(self.planes)

    def point_labels(self) -> IntArray:
        """(N,) surface of each point, in the order of the cloud that was cut."""
        out = np.empty(len(self.cubes.points), np.int64)
        out[self.cubes.order] = self.labels[self.cubes.cube_of]
        return out


def cube_regions(cubes: Cubes, sigma: float, angle_deg: float, min_points: int) -> CubeRegions:
    """Grow surfaces from the flattest cubes outwards.

    Parameters
    ----------
    sigma : metres, noise across the surfaces
    angle_deg : normals of cubes of one surface agree within this
    min_points : fewest points of a surface
    """
    table, sums = cubes.neighbours(), cubes.sums()
    own = _cube_planes(sums, table)
    flat = np.flatnonzero((own[:, ACROSS] <= 2.0 * sigma) & (own[:, BETWEEN] > 3.0 * own[:, ACROSS]))
    seeds = flat[np.argsort(own[flat, ACROSS], kind="stable")]
    limits = np.array([2.0 * sigma, np.cos(np.radians(angle_deg)), float(min_points)])
    labels, planes, counts = _grow(sums, own, table, seeds, limits)
    order = np.argsort(-counts, kind="stable")
    number = np.full(len(order) + 1, -1, np.int64)
    number[order] = np.arange(len(order))
    return CubeRegions(cubes, number[labels], planes[order], counts[order])


@njit(cache=True, nogil=True)
def _cube_planes(sums: FloatArray, table: IntArray) -> FloatArray:
    """(M, 9) plane of each cube; infinitely thick where there are too few points."""
    out = np.zeros((len(sums), 9))
    out[:, ACROSS] = np.inf
    row = np.empty(SUMS)
    for m in range(len(sums)):
        row[:] = sums[m]
        if row[COUNT] < LEAST:
            row[:] = 0.0
            for k in table[m]:
                if k >= 0:
                    row += sums[k]
        if row[COUNT] >= LEAST:
            plane_of(row, out[m])
    return out


@njit(cache=True, nogil=True)
def _off(row: FloatArray, plane: FloatArray) -> float:
    """Root mean square distance (m) of the points that a row of sums counts from a plane."""
    a, b, c = plane[A], plane[B], plane[C]
    d = a * plane[CX] + b * plane[CY] + c * plane[CZ]
    n = row[COUNT]
    mean = (a * row[X] + b * row[Y] + c * row[Z]) / n
    square = a * a * row[XX] + b * b * row[YY] + c * c * row[ZZ]
    square = (square + 2.0 * (a * b * row[XY] + a * c * row[XZ] + b * c * row[YZ])) / n
    return float(np.sqrt(max(square - 2.0 * d * mean + d * d, 0.0)))


@njit(cache=True, nogil=True)
def _grow(
    sums: FloatArray, own: FloatArray, table: IntArray, seeds: IntArray, limits: FloatArray
) -> tuple[IntArray, FloatArray, IntArray]:
    """Label of each cube, plane and number of points of each surface; limits: distance, cosine, fewest points."""
    reach, cosine, least = limits
    labels = np.full(len(sums), -1, np.int64)
    planes, counts = np.empty((len(seeds), 9)), np.empty(len(seeds), np.int64)
    found = 0
    queue = np.empty(len(sums), np.int64)
    row, plane = np.empty(SUMS), np.empty(9)
    for seed in seeds:
        if labels[seed] >= 0:
            continue
        plane[:] = own[seed]
        row[:] = 0.0
        queue[0], size, done, fitted = seed, 1, 0, 0.0
        labels[seed] = found
        row += sums[seed]
        while done < size:
            cube = queue[done]
            done += 1
            for k in table[cube]:
                if k < 0 or labels[k] >= 0 or own[k, ACROSS] == np.inf:
                    continue
                dot = own[k, A] * plane[A] + own[k, B] * plane[B] + own[k, C] * plane[C]
                if abs(dot) < cosine or _off(sums[k], plane) > reach:
                    continue
                labels[k] = found
                queue[size] = k
                size += 1
                row += sums[k]
                if row[COUNT] >= 1.5 * fitted and row[COUNT] >= 2 * LEAST:
                    plane_of(row, plane)
                    fitted = row[COUNT]
        if row[COUNT] < least:
            for j in range(size):
                labels[queue[j]] = -1
            continue
        plane_of(row, plane)
        planes[found], counts[found] = plane, np.int64(row[COUNT])
        found += 1
    return labels, planes[:found], counts[:found]
