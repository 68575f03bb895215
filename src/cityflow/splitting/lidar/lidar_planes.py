"""Points beside a line, and the planes that they lie on at its two sides."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit

REACH_M, BESIDE_M = 1.8, 0.3
"""Planes are fitted to points so far from the line; nearer ones may belong to either side."""
REWEIGHTED = 4
LEAST_POINTS = 6
DEEP_M, BUSHES_M = 0.8, 0.3


class Near(NamedTuple):
    """Points near a line, (n,) float64 each: metres along it from its start, to the left of it, and height."""

    along: FloatArray
    left: FloatArray
    z: FloatArray


class Plane(NamedTuple):
    """A plane in the axes of a line: its height at the start, metres; rise along the line and to the left of it; scatter of its points, metres."""

    level: float
    rise: float
    tilt: float
    scatter: float


@njit(cache=True, nogil=True)
def axes(ends: FloatArray) -> tuple[float, float, float]:
    """Direction (x, y) and length of a line, (2, 2) start and end."""
    length = np.hypot(ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1])
    return (ends[1, 0] - ends[0, 0]) / length, (ends[1, 1] - ends[0, 1]) / length, length


@njit(cache=True, nogil=True)
def beside(points: FloatArray, ends: FloatArray, room: Near) -> Near:
    """Points within reach of a line.

    Parameters
    ----------
    points : (N, 3) in the order of x
    room : (N,) each, where the result is written
    """
    ax, ay, length = axes(ends)
    count = 0
    first = np.searchsorted(points[:, 0], ends[:, 0].min() - REACH_M - 0.2)
    last = np.searchsorted(points[:, 0], ends[:, 0].max() + REACH_M + 0.2)
    for k in range(first, last):
        x, y, z = points[k]
        dx, dy = x - ends[0, 0], y - ends[0, 1]
        t, u = dx * ax + dy * ay, dy * ax - dx * ay
        if -0.2 <= t <= length + 0.2 and abs(u) <= REACH_M:
            room.along[count], room.left[count], room.z[count] = t, u, z
            count += 1
    return Near(room.along[:count], room.left[:count], room.z[:count])


@njit(cache=True, nogil=True)
def off(plane: Plane, t: float, u: float, z: float) -> float:
    """How far a point is above a plane."""
    return z - plane.level - plane.rise * t - plane.tilt * u


@njit(cache=True, nogil=True)
def gap_between(left: Plane, right: Plane, length: float) -> float:
    """How much higher the left plane is at the middle of the line."""
    return left.level - right.level + 0.5 * length * (left.rise - right.rise)


@njit(cache=True, nogil=True)
def side_planes(near: Near, nearest: float) -> tuple[bool, Plane, Plane]:
    """Whether both sides have one, left, right. Where one is no plane but lies far below the other (bushes under an eave), the other stands for
    it, lowered."""
    has_left, left = _plane(near, 1.0, nearest)
    has_right, right = _plane(near, -1.0, nearest)
    if has_left == has_right:
        return has_left, left, right
    known, sign = (left, -1.0) if has_left else (right, 1.0)
    there = near.left * sign > nearest
    if np.sum(there) < LEAST_POINTS:
        return False, left, right
    fall = np.median(near.z[there] - known.level - known.rise * near.along[there] - known.tilt * near.left[there])
    lowered = Plane(known.level + fall, known.rise, known.tilt, BUSHES_M)
    return fall < -DEEP_M, left if has_left else lowered, lowered if has_left else right


@njit(cache=True, nogil=True)
def _plane(near: Near, side: float, nearest: float) -> tuple[bool, Plane]:
    """By least absolute deviations over one side."""
    chosen = near.left * side > nearest
    n = int(np.sum(chosen))
    nothing = Plane(0.0, 0.0, 0.0, 0.0)
    if n < LEAST_POINTS:
        return False, nothing
    a = np.ones((n, 3))
    a[:, 1], a[:, 2] = near.along[chosen], near.left[chosen]
    if np.std(a[:, 1]) < 0.2 or np.std(a[:, 2]) < 0.15:
        return False, nothing
    middle = np.median(near.z[chosen])
    z = near.z[chosen] - middle
    weight = np.ones(n)
    x = np.zeros(3)
    for _ in range(REWEIGHTED):
        aw = a * weight.reshape(n, 1)
        x[:] = np.linalg.solve(a.T @ aw + np.eye(3) * 1e-9, aw.T @ z)
        weight[:] = 1.0 / np.maximum(np.abs(z - a @ x), 0.02)
    level, rise, tilt = x
    scatter = 1.4826 * np.median(np.abs(z - a @ x))
    return scatter < 0.25, Plane(level + middle, rise, tilt, scatter)
