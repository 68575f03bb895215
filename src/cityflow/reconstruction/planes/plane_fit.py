"""Fits of planes z = a·x + b·y + c: plain least squares, and the iterated one with a noise threshold (Gross 2005, §3)."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit


@njit(cache=True, nogil=True)
def solve_plane(points: FloatArray, chosen: IntArray) -> tuple[float, float, float, bool]:
    """Least-squares plane of the chosen points.

    Parameters
    ----------
    points : (N, 3) float64, metres
    chosen : (K,) int64

    Returns
    -------
    a, b, c, sound : coefficients; not sound where the points lie on a line in plan
    """
    n = len(chosen)
    if n < 3:
        return 0.0, 0.0, 0.0, False
    mx = my = mz = 0.0
    for k in chosen:
        mx += points[k, 0]
        my += points[k, 1]
        mz += points[k, 2]
    mx, my, mz = mx / n, my / n, mz / n
    xx = xy = yy = xz = yz = 0.0
    for k in chosen:
        x, y, z = points[k, 0] - mx, points[k, 1] - my, points[k, 2] - mz
        xx += x * x
        xy += x * y
        yy += y * y
        xz += x * z
        yz += y * z
    determinant = xx * yy - xy * xy
    if determinant <= 1e-4 * (xx + yy) ** 2:
        return 0.0, 0.0, mz, False
    a = (xz * yy - yz * xy) / determinant
    b = (yz * xx - xz * xy) / determinant
    return a, b, mz - a * mx - b * my, True


@njit(cache=True, nogil=True)
def distances(points: FloatArray, chosen: IntArray, plane: FloatArray) -> FloatArray:
    """(K,) signed distances of the chosen points across the plane, metres, positive above."""
    scale = np.sqrt(1 + plane[0] * plane[0] + plane[1] * plane[1])
    out = np.empty(len(chosen))
    for k in range(len(chosen)):
        i = chosen[k]
        out[k] = (points[i, 2] - plane[0] * points[i, 0] - plane[1] * points[i, 1] - plane[2]) / scale
    return out


@njit(cache=True, nogil=True)
def fit_iterated(
    points: FloatArray, chosen: IntArray, plane: FloatArray, threshold: float, iterations: int
) -> tuple[FloatArray, bool]:
    """Refit to the points nearer than a noise threshold until they no longer change.

    The threshold is 2.5 times the spread of the distances (normalised median of absolutes), but no less than `threshold`.

    Parameters
    ----------
    points : (N, 3) float64;  chosen : (K,) int64;  plane : (3,) float64, a first guess
    threshold : metres, across the plane

    Returns
    -------
    plane : (3,) float64
    sound : False where too few points are left or they lie on a line
    """
    kept = chosen
    current = plane.copy()
    for _ in range(iterations):
        distance = np.abs(distances(points, chosen, current))
        limit = max(threshold, 2.5 * 1.4826 * np.median(distance)) if len(distance) else threshold
        nearer = chosen[distance <= limit]
        a, b, c, sound = solve_plane(points, nearer)
        if not sound:
            return current, False
        current = np.array([a, b, c])
        if len(nearer) == len(kept) and np.all(nearer == kept):
            break
        kept = nearer
    return current, True


def plan_width(points: FloatArray, chosen: IntArray) -> float:
    """Width across (m) of the even strip that spreads in plan as much as the chosen points do."""
    if len(chosen) < 3:
        return 0.0
    xy = points[chosen, :2].T
    xy = xy - xy.mean(axis=1)[:, None]
    covariance = np.dot(xy, xy.T) * (1.0 / (len(chosen) - 1))
    return float(np.sqrt(12 * max(np.linalg.eigvalsh(covariance)[0], 0.0)))
