"""The raised part of a roof plane that fits heights best: a rectangle in the plane's own frame, its roof, and how wide matching has smoothed its sides.

Heights are those over the plane, `u` runs along its level lines and `v` up it. A part is eight numbers: its sides (`U0`, `U1`), its front and its back
(`V0`, `V1`), its height over the plane at the front in the middle (`HEIGHT`), how that changes with `v` (`TILT`: minus the plane's slope for a level roof) and
with the distance from the middle (`FALL`: of a gable), and the half width of the ramp that matching draws across a step (`RAMP`).
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

U0, U1, V0, V1, HEIGHT, TILT, FALL, RAMP = range(8)
BOTH = 8
"""Both sides together: the part is moved along its plane."""
NO_BACK = 1e3
"""`V1` of a part that ends where its roof meets the plane, metres."""
SCALES = (1.0, 0.5, 0.25, 0.125)
"""Of the steps of the search, one after the other."""
STEPS = np.array([0.4, 0.4, 0.4, 0.4, 0.2, 0.2, 0.2, 0.2, 0.4])
"""Of each number, metres or slopes, and of both sides."""
SWEEPS = 8
"""Most rounds over all numbers for each scale."""
LEAST_M, RAMPS_M = 0.6, (0.05, 0.8)
"""Narrower parts are edges; widths of ramps that matching draws."""


@njit(cache=True, nogil=True)
def left_by(part: FloatArray, uvh: FloatArray, apart: FloatArray, most: float) -> float:
    """Sum of squared heights (m²) that a part leaves of points near it, each at most `most` (m).

    Parameters
    ----------
    uvh : (N, 3) places in the plane's frame, and heights over it, metres;  apart : (N,) what points beyond the part and its ramp count, m²
    """
    total = 0.0
    for i in range(len(uvh)):
        share, height = part_at(part, uvh[i, 0], uvh[i, 1])
        if share < 0:
            total += apart[i]
        else:
            off = min(abs(uvh[i, 2] - share * height), most)
            total += off * off
    return total


@njit(cache=True, nogil=True)
def part_at(part: FloatArray, u: float, v: float) -> tuple[float, float]:
    """Share of the ramp that is climbed at a place, −1 beyond it; and height of the part over the plane, metres."""
    inside = min(min(u - part[0], part[1] - u), min(v - part[2], part[3] - v))
    if inside <= -part[7]:
        return -1.0, 0.0
    u, v = min(max(u, part[0]), part[1]), min(max(v, part[2]), part[3])
    height = part[4] + part[5] * (v - part[2]) - part[6] * abs(u - (part[0] + part[1]) / 2)
    return min(0.5 + inside / (2 * part[7]), 1.0), max(height, 0.0)


@njit(cache=True, nogil=True)
def parts_at(part: FloatArray, uv: FloatArray) -> FloatArray:
    """(N, 2) of `part_at` at places (N, 2)."""
    found = np.empty((len(uv), 2))
    for i in range(len(uv)):
        found[i] = part_at(part, uv[i, 0], uv[i, 1])
    return found


@njit(cache=True, nogil=True)
def fitted(
    part: FloatArray, free: IntArray, uvh: FloatArray, apart: FloatArray, most: float
) -> tuple[FloatArray, float]:
    """The part with its free numbers moved until no step makes `left_by` less, and that."""
    best = left_by(part, uvh, apart, most)
    for scale in SCALES:
        for _ in range(SWEEPS):
            before = best
            for k in free:
                for way in (-scale, scale):
                    while True:
                        other = part.copy()
                        if k == BOTH:
                            other[:2] += way * STEPS[k]
                        else:
                            other[k] += way * STEPS[k]
                        if not _possible(other):
                            break
                        left = left_by(other, uvh, apart, most)
                        if left >= best - 1e-9:
                            break
                        part, best = other, left
            if before - best < 1e-6:
                break
    return part, best


@njit(cache=True, nogil=True)
def _possible(part: FloatArray) -> bool:
    wide, deep = part[1] - part[0], part[3] - part[2]
    standing = part[6] >= 0 and part[4] >= part[6] * wide / 2
    return wide >= LEAST_M and deep >= LEAST_M and standing and RAMPS_M[0] <= part[7] <= RAMPS_M[1]
