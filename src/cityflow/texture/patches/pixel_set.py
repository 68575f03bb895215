"""Pixels that a polygon covers, and their depth inside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.kernels import njit


def depth_inside(rings: Sequence[FloatArray], rows: int, cols: int, reach: float) -> Float32Array:
    """Distance of each pixel's centre from the polygon's boundary, positive inside, no more than `reach` either way.

    Parameters
    ----------
    rings : (n, 2) column, row of the corners of each ring; (0, 0) is the corner of the first pixel. Inside by the even-odd rule
    rows, cols : of the raster
    reach : pixels

    Returns
    -------
    (rows, cols) float32, pixels
    """
    start = np.concatenate([[0], np.cumsum([len(r) for r in rings])]).astype(np.int64)
    xy = np.ascontiguousarray(np.concatenate(rings), np.float64)
    return np.asarray(_depth(xy, start, rows, cols, float(reach)))


@njit(cache=True, nogil=True)
def _depth(xy, start, rows, cols, reach):  # type: ignore[no-untyped-def]
    out = np.full((rows, cols), reach, np.float32)
    for k in range(start.size - 1):
        n = start[k + 1] - start[k]
        for i in range(n):
            a, b = start[k] + i, start[k] + (i + 1) % n
            _along_edge(out, xy[a, 0], xy[a, 1], xy[b, 0], xy[b, 1], reach)
    crossings = np.empty(xy.shape[0], np.float64)
    for r in range(rows):
        count = _crossings(xy, start, r + 0.5, crossings)
        met = np.sort(crossings[:count])
        next_one, inside = 0, False
        for c in range(cols):
            while next_one < count and met[next_one] <= c + 0.5:
                inside = not inside
                next_one += 1
            if not inside:
                out[r, c] = -out[r, c]
    return out


@njit(cache=True, nogil=True)
def _crossings(xy, start, y, crossings):  # type: ignore[no-untyped-def]
    count = 0
    for k in range(start.size - 1):
        n = start[k + 1] - start[k]
        for i in range(n):
            a, b = start[k] + i, start[k] + (i + 1) % n
            if (xy[a, 1] <= y) != (xy[b, 1] <= y):
                crossings[count] = xy[a, 0] + (y - xy[a, 1]) / (xy[b, 1] - xy[a, 1]) * (xy[b, 0] - xy[a, 0])
                count += 1
    return count


@njit(cache=True, nogil=True)
def _along_edge(out, x_0, y_0, x_1, y_1, reach):  # type: ignore[no-untyped-def]
    rows, cols = out.shape
    dx, dy = x_1 - x_0, y_1 - y_0
    length2 = dx * dx + dy * dy
    top, bottom = min(y_0, y_1) - reach, max(y_0, y_1) + reach
    for r in range(max(0, int(np.floor(top))), min(rows, int(np.ceil(bottom)) + 1)):
        y = r + 0.5
        low, high = 0.0, 1.0
        if abs(dy) > 1e-12:
            t_0, t_1 = (y - reach - y_0) / dy, (y + reach - y_0) / dy
            low, high = max(0.0, min(t_0, t_1)), min(1.0, max(t_0, t_1))
        if low > high:
            continue
        left = min(x_0 + low * dx, x_0 + high * dx) - reach
        right = max(x_0 + low * dx, x_0 + high * dx) + reach
        for c in range(max(0, int(np.floor(left))), min(cols, int(np.ceil(right)) + 1)):
            x = c + 0.5
            t = ((x - x_0) * dx + (y - y_0) * dy) / length2 if length2 > 0.0 else 0.0
            t = min(max(t, 0.0), 1.0)
            distance = np.hypot(x - x_0 - t * dx, y - y_0 - t * dy)
            if distance < out[r, c]:
                out[r, c] = distance
