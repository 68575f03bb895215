"""Edges of a triangulation flipped until it is Delaunay's, within the polygon."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

FLIP_MARGIN = 1e-9
"""Sine by which opposite angles must be beyond π to be flipped: keeps cocircular corners from flipping for ever."""


@njit(cache=True, nogil=True)
def cross_product(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the signed area of a triangle in the plane."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@njit(cache=True, nogil=True)
def flip_edges(xy: FloatArray, triangles: IntArray) -> None:
    """Flip inner edges in place until the two angles opposite each are no more than π together (Lawson)."""
    across = _neighbours(triangles)
    count = len(triangles)
    for _ in range(4 * count + 4):
        changed = False
        for t in range(count):
            for e in range(3):
                if across[t, e] >= 0 and _flip_edge(xy, triangles, across, t, e):
                    changed = True
        if not changed:
            return


@njit(cache=True, nogil=True)
def _neighbours(triangles: IntArray) -> IntArray:
    """(T, 3) for edge e (corner e to e + 1): 3 · triangle + edge on its other side, −1 at the boundary."""
    count = len(triangles)
    across = np.full((count, 3), -1, np.int64)
    if count == 0:
        return across
    span = triangles.max() + 1
    forward, backward = np.empty(3 * count, np.int64), np.empty(3 * count, np.int64)
    for t in range(count):
        for e in range(3):
            u, v = triangles[t, e], triangles[t, (e + 1) % 3]
            forward[3 * t + e], backward[3 * t + e] = u * span + v, v * span + u
    order = np.argsort(forward, kind="mergesort")
    ordered = forward[order]
    for t in range(count):
        for e in range(3):
            at = np.searchsorted(ordered, backward[3 * t + e])
            if at < 3 * count and ordered[at] == backward[3 * t + e]:
                across[t, e] = order[at]
    return across


@njit(cache=True, nogil=True)
def _more_than_pi(p: FloatArray, q: FloatArray, u: FloatArray, v: FloatArray) -> bool:
    """True where the angles at p and q over the edge u–v are more than π together: the sine of their sum is negative.

    Angles are unsigned, so that slivers which rounding has turned over count as π, not −π.
    """
    sin_p, cos_p = abs(cross_product(p, u, v)), (u[0] - p[0]) * (v[0] - p[0]) + (u[1] - p[1]) * (v[1] - p[1])
    sin_q, cos_q = abs(cross_product(q, u, v)), (u[0] - q[0]) * (v[0] - q[0]) + (u[1] - q[1]) * (v[1] - q[1])
    size = np.sqrt((sin_p * sin_p + cos_p * cos_p) * (sin_q * sin_q + cos_q * cos_q))
    return bool(sin_p * cos_q + cos_p * sin_q < -FLIP_MARGIN * size)


@njit(cache=True, nogil=True)
def _flip_edge(xy: FloatArray, triangles: IntArray, across: IntArray, t: int, e: int) -> bool:
    """Replace the edge u–v between apexes p and q by p–q where that is Delaunay."""
    other, f = across[t, e] // 3, across[t, e] % 3
    u, v, p = triangles[t, e], triangles[t, (e + 1) % 3], triangles[t, (e + 2) % 3]
    q = triangles[other, (f + 2) % 3]
    if not _more_than_pi(xy[p], xy[q], xy[u], xy[v]):
        return False
    up, vp = across[t, (e + 2) % 3], across[t, (e + 1) % 3]
    uq, vq = across[other, (f + 1) % 3], across[other, (f + 2) % 3]
    triangles[t, 0], triangles[t, 1], triangles[t, 2] = p, u, q
    triangles[other, 0], triangles[other, 1], triangles[other, 2] = q, v, p
    across[t, 0], across[t, 1], across[t, 2] = up, uq, 3 * other + 2
    across[other, 0], across[other, 1], across[other, 2] = vq, vp, 3 * t + 2
    for new, old in ((3 * t, up), (3 * t + 1, uq), (3 * other, vq), (3 * other + 1, vp)):
        if old >= 0:
            across[old // 3, old % 3] = new
    return True
