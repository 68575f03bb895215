"""Lines that say again what another line has said."""

from __future__ import annotations

import numpy as np
from numba import njit

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

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
        d = ends[i, 1] - ends[i, 0]
        length[i] = max(np.hypot(d[0], d[1]), 1e-9)
        along[i] = d / length[i]
    kept, count = np.empty(n, np.int64), 0
    for i in order:
        said = np.zeros(PLACES, np.bool_)
        for k in kept[:count]:
            if abs(along[i, 0] * along[k, 1] - along[i, 1] * along[k, 0]) > sine:
                continue
            for p in range(PLACES):
                place = ends[i, 0] + (p + 0.5) / PLACES * length[i] * along[i] - ends[k, 0]
                t = place[0] * along[k, 0] + place[1] * along[k, 1]
                u = place[1] * along[k, 0] - place[0] * along[k, 1]
                said[p] |= abs(u) < apart and -apart < t < length[k] + apart
        if said.mean() <= MOSTLY:
            keep[i] = True
            kept[count] = i
            count += 1
    return keep
