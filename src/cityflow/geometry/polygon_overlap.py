"""Common volume of two polyhedra, exact for planar faces.

A solid is the signed sum of the columns below its triangles: those that face up count positive, those that face down
negative. The common volume is then a double sum over pairs of triangles: signs times the integral, over the
intersection of both in plan, of the lower of the two planes. No Boolean of solids is formed, so touching faces
and party walls need no care.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron
from cityflow.core.kernels import njit
from cityflow.geometry.polyhedron import bounds_3d, triangulate

MOST_CORNERS = 12
"""Two triangles meet in at most six corners, a cut adds one; room for rounding."""


def overlap_volume(a: Polyhedron, b: Polyhedron) -> float:
    """Common volume, m³, of two closed shells with outward faces."""
    if not a.faces or not b.faces:
        return 0.0
    (a_low, a_high), (b_low, b_high) = bounds_3d(a), bounds_3d(b)
    low, high = np.maximum(a_low, b_low), np.minimum(a_high, b_high)
    if np.any(low >= high):
        return 0.0
    origin = np.array([low[0], low[1], min(a_low[2], b_low[2])])
    total = _common_volume(_corners(a, origin), _corners(b, origin))
    return max(float(total), 0.0)


def _corners(polyhedron: Polyhedron, origin: FloatArray) -> FloatArray:
    """(T, 3, 3) corners of the triangles in a frame that both solids share."""
    mesh = triangulate(polyhedron)
    corners: FloatArray = (mesh.vertices - origin)[mesh.triangles]
    return corners


@njit(cache=True, nogil=True)
def _common_volume(one: FloatArray, two: FloatArray) -> float:
    """Sum over all pairs of triangles, (T, 3, 3) metres, all heights positive."""
    one_planes, one_signs = _planes(one)
    two_planes, two_signs = _planes(two)
    total = 0.0
    polygon, scratch = np.empty((MOST_CORNERS, 2)), np.empty((MOST_CORNERS, 2))
    for i in range(len(one)):
        if one_signs[i] == 0:
            continue
        for j in range(len(two)):
            if two_signs[j] == 0 or not _plans_meet(one[i], two[j]):
                continue
            n = clip_triangles(one[i], two[j], polygon, scratch)
            if n >= 3:
                total += one_signs[i] * two_signs[j] * _lower_integral(polygon, n, one_planes[i], two_planes[j])
    return total


@njit(cache=True, nogil=True)
def _planes(triangles: FloatArray) -> tuple[FloatArray, IntArray]:
    """(T, 3) coefficients a, b, c of z = a·x + b·y + c, and (T,) 1 facing up, −1 down, 0 vertical."""
    planes, signs = np.zeros((len(triangles), 3)), np.zeros(len(triangles), np.int64)
    for t in range(len(triangles)):
        p, u, v = triangles[t, 0], triangles[t, 1] - triangles[t, 0], triangles[t, 2] - triangles[t, 0]
        nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        if abs(nz) <= 1e-9 * np.sqrt(nx * nx + ny * ny + nz * nz):
            continue
        planes[t, 0], planes[t, 1] = -nx / nz, -ny / nz
        planes[t, 2] = p[2] - planes[t, 0] * p[0] - planes[t, 1] * p[1]
        signs[t] = 1 if nz > 0 else -1
    return planes, signs


@njit(cache=True, nogil=True)
def _plans_meet(a: FloatArray, b: FloatArray) -> bool:
    meet = True
    for k in range(2):
        meet &= min(a[0, k], a[1, k], a[2, k]) < max(b[0, k], b[1, k], b[2, k])
        meet &= min(b[0, k], b[1, k], b[2, k]) < max(a[0, k], a[1, k], a[2, k])
    return meet


@njit(cache=True, nogil=True)
def clip_triangles(a: FloatArray, b: FloatArray, polygon: FloatArray, scratch: FloatArray) -> int:
    """Corners, counted and written to `polygon`, of the intersection in plan of two triangles of either direction."""
    for k in range(3):
        polygon[k, 0], polygon[k, 1] = a[k, 0], a[k, 1]
    turn = (b[1, 0] - b[0, 0]) * (b[2, 1] - b[0, 1]) - (b[1, 1] - b[0, 1]) * (b[2, 0] - b[0, 0])
    n = 3
    for k in range(3):
        p, q = b[k], b[(k + 1) % 3]
        nx, ny = (q[1] - p[1]) * turn, (p[0] - q[0]) * turn
        n = _cut(polygon, n, (nx, ny, -(nx * p[0] + ny * p[1])), scratch)
    return n


@njit(cache=True, nogil=True)
def _cut(polygon: FloatArray, n: int, line: tuple[float, float, float], scratch: FloatArray) -> int:
    """Keep, in place, what of a convex polygon has line[0]·x + line[1]·y + line[2] <= 0 (Sutherland, Hodgman)."""
    kept = 0
    for k in range(n):
        p, q = _at(polygon, k), _at(polygon, (k + 1) % n)
        dp = line[0] * p[0] + line[1] * p[1] + line[2]
        dq = line[0] * q[0] + line[1] * q[1] + line[2]
        if dp <= 0 and kept < MOST_CORNERS:
            scratch[kept, 0], scratch[kept, 1] = p
            kept += 1
        if ((dp < 0 and dq > 0) or (dp > 0 and dq < 0)) and kept < MOST_CORNERS:
            t = dp / (dp - dq)
            scratch[kept, 0], scratch[kept, 1] = p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])
            kept += 1
    _copy(scratch, kept, polygon)
    return kept


@njit(cache=True, nogil=True)
def _at(polygon: FloatArray, k: int) -> tuple[float, float]:
    return polygon[k, 0], polygon[k, 1]


@njit(cache=True, nogil=True)
def _copy(polygon: FloatArray, n: int, target: FloatArray) -> None:
    """The first n corners; slices that are assigned take seconds to compile."""
    for k in range(n):
        target[k, 0], target[k, 1] = polygon[k, 0], polygon[k, 1]


@njit(cache=True, nogil=True)
def _lower_integral(polygon: FloatArray, n: int, one: FloatArray, two: FloatArray) -> float:
    """Integral over a convex polygon of the lower of two planes."""
    a, b, c = one[0] - two[0], one[1] - two[1], one[2] - two[2]
    part, scratch = np.empty((MOST_CORNERS, 2)), np.empty((MOST_CORNERS, 2))
    _copy(polygon, n, part)
    total = _integral(part, _cut(part, n, (a, b, c), scratch), one)
    _copy(polygon, n, part)
    if a != 0 or b != 0 or c != 0:
        total += _integral(part, _cut(part, n, (-a, -b, -c), scratch), two)
    return total


@njit(cache=True, nogil=True)
def _integral(polygon: FloatArray, n: int, plane: FloatArray) -> float:
    """Integral of a plane over a convex polygon: fan of triangles, each its area times the height at its centroid."""
    total = 0.0
    for k in range(1, n - 1):
        p, q, r = _at(polygon, 0), _at(polygon, k), _at(polygon, k + 1)
        area = ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / 2
        x, y = (p[0] + q[0] + r[0]) / 3, (p[1] + q[1] + r[1]) / 3
        total += abs(area) * (plane[0] * x + plane[1] * y + plane[2])
    return total
