"""Where a line runs between the planes of its two sides: where they meet, where points change from one to the other, or along a wall above both.

Each function returns whether there is such a line, and how far to the left of the start and of the end of the given one it runs, metres.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.kernels import njit
from cityflow.splitting.lidar.lidar_planes import DEEP_M, LEAST_POINTS, Near, Plane, gap_between, off

AWAY_M = 1.1
WALL_M = 0.2
FITTING_M = 0.08
"""A point belongs to a plane that is this near, or three times the plane's scatter."""
STRIDE_M = 0.5
ANGLES = 13
PARTED = 0.9
"""Share of the points on their own side of a step."""


@njit(cache=True, nogil=True)
def crease(left: Plane, right: Plane, length: float) -> tuple[bool, float, float]:
    """Where both planes have one height."""
    fall = right.tilt - left.tilt
    start = (left.level - right.level) / fall
    end = (left.level - right.level + (left.rise - right.rise) * length) / fall
    return abs(start) < AWAY_M and abs(end) < AWAY_M, start, end


@njit(cache=True, nogil=True)
def _belongs(to_upper: float, to_lower: float, upper: Plane, lower: Plane, deep: bool) -> int:
    """1 for a point of the upper plane, -1 for one of the lower one or, where that is deep down, anything well below the upper; 0 for neither."""
    if abs(to_upper) < max(FITTING_M, 3 * upper.scatter) and abs(to_lower) > 2 * abs(to_upper):
        return 1
    if deep:
        return -1 if to_upper < -0.5 * DEEP_M else 0
    return -1 if abs(to_lower) < max(FITTING_M, 3 * lower.scatter) and abs(to_upper) > 2 * abs(to_lower) else 0


@njit(cache=True, nogil=True)
def step(near: Near, left: Plane, right: Plane, length: float, widest: float) -> tuple[bool, float, float]:
    """The line that parts the points of both planes best; of many as good ones their mean.

    Parameters
    ----------
    widest : how far it may turn, radians
    """
    n = len(near.z)
    t, u, own = np.empty(n), np.empty(n), np.empty(n)
    count = 0
    gap = gap_between(left, right, length)
    upper, lower, sign = (left, right, 1.0) if gap > 0 else (right, left, -1.0)
    for k in range(n):
        point = near.along[k], near.left[k], near.z[k]
        side = _belongs(off(upper, *point), off(lower, *point), upper, lower, abs(gap) > DEEP_M)
        if side != 0:
            t[count], u[count], own[count] = near.along[k], near.left[k], sign * side
            count += 1
    if count < 2 * LEAST_POINTS:
        return False, 0.0, 0.0
    fewest, total, sum_at, sum_turn = count, 0, 0.0, 0.0
    for k in range(ANGLES):
        angle = widest * (2 * k / (ANGLES - 1) - 1)
        turned = u[:count] - (t[:count] - 0.5 * length) * np.tan(angle)
        order = np.argsort(turned)
        wrong = int(np.sum(own[:count] < 0))  # all points left of the line: those of the right plane are wrong
        for j in range(count - 1):
            wrong += 1 if own[order[j]] > 0 else -1
            if wrong > fewest:
                continue
            at = 0.5 * (turned[order[j]] + turned[order[j + 1]])
            if wrong < fewest:
                fewest, total, sum_at, sum_turn = wrong, 0, 0.0, 0.0
            total, sum_at, sum_turn = total + 1, sum_at + at, sum_turn + np.tan(angle)
    if total == 0 or fewest > (1 - PARTED) * count:
        return False, 0.0, 0.0
    at, slant = sum_at / total, sum_turn / total
    start, end = at - 0.5 * length * slant, at + 0.5 * length * slant
    return abs(start) < AWAY_M + 0.3 and abs(end) < AWAY_M + 0.3, start, end


@njit(cache=True, nogil=True)
def firewall(near: Near, left: Plane, right: Plane, length: float) -> tuple[bool, float, float]:
    """A line through the points that rise above both planes, where they follow one another along most of the way."""
    n = len(near.z)
    t, u = np.empty(n), np.empty(n)
    count = 0
    bins = max(int(length / STRIDE_M), 2)
    met = np.zeros(bins)
    for k in range(n):
        along, across = near.along[k], near.left[k]
        if abs(across) > 0.7:
            continue
        above = near.z[k] - max(
            left.level + left.rise * along + left.tilt * across, right.level + right.rise * along + right.tilt * across
        )
        if WALL_M < above < 1.5:
            t[count], u[count] = along, across
            met[min(max(int(along / length * bins), 0), bins - 1)] = 1
            count += 1
    if count < LEAST_POINTS or np.mean(met) < 0.7:
        return False, 0.0, 0.0
    centre_t, centre_u = np.mean(t[:count]), np.mean(u[:count])
    spread = np.sum((t[:count] - centre_t) ** 2)
    slant = np.sum((t[:count] - centre_t) * (u[:count] - centre_u)) / max(spread, 1e-9)
    rest = u[:count] - centre_u - slant * (t[:count] - centre_t)
    return np.std(rest) < 0.3, centre_u - slant * centre_t, centre_u + slant * (length - centre_t)
