"""Evenness of the surroundings of a point: high on roofs at any density, low in foliage."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

NEIGHBOURS = 12
"""Four times those of a plane; set by hand."""


def unevenness(xyz: FloatArray) -> FloatArray:
    """(N,) how thick the most even patch around each point is, as a share of how far it reaches; 0 to 1.

    A patch is a point with its nearest ones in space, `NEIGHBOURS` in all, so a façade is even, too. A point is part of the patches of
    all its neighbours: at an eave or a ridge that beside the edge counts. The ratio needs neither noise nor density: in foliage
    a patch is about as thick as wide, however many points there are. Fewer than `NEIGHBOURS` points say nothing: 1.

    Parameters
    ----------
    xyz : (N, 3) points, metres
    """
    if len(xyz) < NEIGHBOURS:
        return np.ones(len(xyz))
    local = xyz - xyz.mean(axis=0)
    _, near = cKDTree(local, balanced_tree=False).query(local, k=NEIGHBOURS)
    return np.asarray(_ratios(local, near)[near].min(axis=1))


@njit(cache=True, nogil=True)
def _ratios(xyz: FloatArray, near: IntArray) -> FloatArray:
    """Square root of the smallest over the middle eigenvalue of the scatter of each point's (N, k) neighbours."""
    n, k = near.shape
    out = np.empty(n)
    middle, s = np.empty(3), np.empty((3, 3))
    for i in range(n):
        for a in range(3):
            middle[a] = 0.0
            for j in range(k):
                middle[a] += xyz[near[i, j], a] / k
        for a in range(3):
            for b in range(a + 1):
                total = 0.0
                for j in range(k):
                    total += (xyz[near[i, j], a] - middle[a]) * (xyz[near[i, j], b] - middle[b])
                s[a, b] = total / k
        out[i] = _thickness(s)
    return out


@njit(cache=True, nogil=True)
def _thickness(s: FloatArray) -> float:
    """Root of the smallest over the middle eigenvalue of a symmetric 3 x 3 matrix (its lower half), in closed form."""
    centre = (s[0, 0] + s[1, 1] + s[2, 2]) / 3
    a, b, c = s[0, 0] - centre, s[1, 1] - centre, s[2, 2] - centre
    d, e, f = s[1, 0], s[2, 0], s[2, 1]
    scale = np.sqrt((a * a + b * b + c * c + 2 * (d * d + e * e + f * f)) / 6)
    if scale < 1e-12:
        return 1.0
    half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / (2 * scale**3)
    angle = np.arccos(min(max(half, -1.0), 1.0)) / 3
    smallest = centre + 2 * scale * np.cos(angle + 2 * np.pi / 3)
    mid = 3 * centre - smallest - (centre + 2 * scale * np.cos(angle))
    return float(np.sqrt(max(smallest, 0.0) / max(mid, 1e-12)))
