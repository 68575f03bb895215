"""Removes lines that mostly repeat another line."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit

PLACES = 9
MOST_COVERED = 0.6


def without_repeats(ends: FloatArray, order: IntArray, apart: float, apart_deg: float) -> BoolArray:
    """(N,) true for lines of which at most `MOST_COVERED` lies on lines of the same direction that precede them in `order`.

    Parameters
    ----------
    ends : (N, 2, 2) plane coordinates of start and end
    order : (N,) numbers of the lines, the most reliable first
    apart : largest distance of a repeat, in the unit of `ends`
    """
    return np.asarray(_without_repeats(np.ascontiguousarray(ends), order, apart, np.sin(np.radians(apart_deg))))


@njit(cache=True, nogil=True)
def _without_repeats(ends: FloatArray, order: IntArray, apart: float, sine: float) -> BoolArray:
    n = len(ends)
    keep, length, along = np.zeros(n, np.bool_), np.empty(n), np.empty((n, 2))
    for i in range(n):
        dx, dy = ends[i, 1, 0] - ends[i, 0, 0], ends[i, 1, 1] - ends[i, 0, 1]
        length[i] = max(np.hypot(dx, dy), 1e-9)
        along[i, 0], along[i, 1] = dx / length[i], dy / length[i]
    kept, count = np.empty(n, np.int64), 0
    covered = np.zeros(PLACES, np.bool_)
    for i in order:
        covered[:] = False
        ax, ay = along[i, 0], along[i, 1]
        for j in range(count):
            k = kept[j]
            bx, by = along[k, 0], along[k, 1]
            if abs(ax * by - ay * bx) > sine:
                continue
            x, y = ends[i, 0, 0] - ends[k, 0, 0], ends[i, 0, 1] - ends[k, 0, 1]
            # far on one side at both ends: nowhere near
            u0, u1 = y * bx - x * by, (y + ay * length[i]) * bx - (x + ax * length[i]) * by
            if min(u0, u1) > apart or max(u0, u1) < -apart:
                continue
            for p in range(PLACES):
                s = (p + 0.5) / PLACES
                t = (x + s * length[i] * ax) * bx + (y + s * length[i] * ay) * by
                covered[p] |= abs(u0 + s * (u1 - u0)) < apart and -apart < t < length[k] + apart
        if covered.mean() <= MOST_COVERED:
            keep[i] = True
            kept[count] = i
            count += 1
    return keep
