"""Lines that say again what another line has said."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit

PLACES = 9
MOSTLY = 0.6


def first_said(ends: FloatArray, order: IntArray, apart: float, apart_deg: float) -> BoolArray:
    """(N,) lines that do not lie for their most part on lines of their direction that come before them in `order`.

    Parameters
    ----------
    ends : (N, 2, 2) plane coordinates of start and end
    order : (N,) numbers of the lines, the one to trust most first
    apart : what is nearer is the same, in the unit of `ends`
    """
    return np.asarray(_first_said(np.ascontiguousarray(ends), order, apart, np.sin(np.radians(apart_deg))))


@njit(cache=True, nogil=True)
def _first_said(ends: FloatArray, order: IntArray, apart: float, sine: float) -> BoolArray:
    n = len(ends)
    keep, length, along = np.zeros(n, np.bool_), np.empty(n), np.empty((n, 2))
    for i in range(n):
        dx, dy = ends[i, 1, 0] - ends[i, 0, 0], ends[i, 1, 1] - ends[i, 0, 1]
        length[i] = max(np.hypot(dx, dy), 1e-9)
        along[i, 0], along[i, 1] = dx / length[i], dy / length[i]
    kept, count = np.empty(n, np.int64), 0
    said = np.zeros(PLACES, np.bool_)
    for i in order:
        said[:] = False
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
                said[p] |= abs(u0 + s * (u1 - u0)) < apart and -apart < t < length[k] + apart
        if said.mean() <= MOSTLY:
            keep[i] = True
            kept[count] = i
            count += 1
    return keep
