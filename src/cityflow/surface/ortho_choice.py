"""Which images colour a cell, and with what weight.

An image's cost in a cell is the length on the ground that a pixel covers times the square of the slant (1 + tan²), which grows without bound towards the
rim of the picture. For images of one height and camera the cheapest one is the one whose nadir is nearest: seams are those of Voronoi
cells. The weight of a dearer image falls with its distance from the seam, which is the difference of the two costs over its slope; so nothing but the
cell itself, the images and the surface between cell and cameras has a say.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cityflow.surface.ortho_camera import project
from cityflow.surface.ortho_visibility import is_hidden

BLENDED = 4
"""Images that may mix in one cell."""

CLOSE = 0.3
"""Images dearer than the best by this share never mix in, however steeply costs rise."""

STEEPEST_RISE = 8.0
"""Outside rims two costs draw apart by less than this share of them for each height of flight: 2 · (tan 60° + tan 60°), and a bit."""

STEP_M = 0.5


@njit(cache=True, nogil=True, inline="always")
def _base_cost(row, x, y, z, steepest):  # type: ignore[no-untyped-def]
    """Metres per pixel times slant, a lower bound of `_cost`; infinite where the ray is too flat."""
    dx, dy, h = row[9] - x, row[10] - y, row[11] - z
    if h <= 0.0:
        return np.inf
    slant = (dx * dx + dy * dy) / (h * h)
    if slant > steepest:
        return np.inf
    return h / row[12] * (1.0 + slant)


@njit(cache=True, nogil=True, inline="always")
def _cost(row, x, y, z, steepest, rim, margin):  # type: ignore[no-untyped-def]
    """The cost, where the point is in the image, and whether the rim has a say."""
    base = _base_cost(row, x, y, z, steepest)
    if base == np.inf:
        return np.inf, 0.0, 0.0, 0.0, False
    u, v, depth = project(row, x, y, z)
    if depth <= 0.0:
        return np.inf, 0.0, 0.0, 0.0, False
    inside = min(min(u, row[24] - u), min(v, row[25] - v)) - margin
    if inside <= 0.0:
        return np.inf, 0.0, 0.0, 0.0, False
    t = min(1.0, inside / (rim * min(row[24], row[25])))
    return base / (t * (2.0 - t)), u, v, depth, t < 1.0


@njit(cache=True, nogil=True)
def _slope(a, b, a_rim, b_rim, x, y, z, difference, limits):  # type: ignore[no-untyped-def]
    """How fast the difference of two costs grows along the ground, per metre."""
    if not (a_rim or b_rim):
        ha, hb = a[12] * (a[11] - z), b[12] * (b[11] - z)
        return 2.0 * np.hypot((x - a[9]) / ha - (x - b[9]) / hb, (y - a[10]) / ha - (y - b[10]) / hb)
    steepest, rim, margin = limits[0], limits[1], limits[2]
    ax = _cost(a, x + STEP_M, y, z, steepest, rim, margin)[0]
    bx = _cost(b, x + STEP_M, y, z, steepest, rim, margin)[0]
    ay = _cost(a, x, y + STEP_M, z, steepest, rim, margin)[0]
    by = _cost(b, x, y + STEP_M, z, steepest, rim, margin)[0]
    slope = np.hypot(bx - ax - difference, by - ay - difference) / STEP_M
    return slope if np.isfinite(slope) else 0.0


@njit(cache=True, nogil=True)
def choose(  # type: ignore[no-untyped-def]
    xs, ys, heights, cameras, levels, layout, place, sharp, limits, out_image, out_weight, out_u, out_v, out_scale
):
    """Fill images, weights, image coordinates and pixels per metre of depth for each cell of a block.

    limits: greatest tan² off the frame's nadir, width of the rim as a share of the image, margin in pixels, half width of a seam in metres.
    Weights of a cell add up to 1; where the image is -1 there is none.
    """
    rows, cols = heights.shape
    n = cameras.shape[0]
    bound, where = np.empty(n), np.empty((n, 5))
    for r in range(rows):
        for c in range(cols):
            z = heights[r, c]
            for k in range(out_image.shape[2]):
                out_image[r, c, k] = -1
            if np.isnan(z):
                continue
            x, y = xs[c], ys[r]
            for i in range(n):
                bound[i] = _base_cost(cameras[i], x, y, z, limits[0])
                where[i, 4] = 0.0
            _fill_cell(
                bound, where, x, y, z, cameras, levels, layout, place, sharp, limits,
                out_image[r, c], out_weight[r, c], out_u[r, c], out_v[r, c], out_scale[r, c],
            )  # fmt: skip


@njit(cache=True, nogil=True)
def _fill_cell(  # type: ignore[no-untyped-def]
    bound, where, x, y, z, cameras, levels, layout, place, sharp, limits, image, weight, us, vs, scale
):
    """Images in order of cost: lower bounds become costs when their turn comes, and only those that would mix are looked at from."""
    found, best, total = 0, 0, 0.0
    cheapest, room = np.inf, np.inf
    while found < image.shape[0]:
        i, cost = -1, np.inf
        for k in range(bound.shape[0]):
            if bound[k] < cost:
                i, cost = k, bound[k]
        if i < 0 or cost >= cheapest + room:
            break
        row = cameras[i]
        if where[i, 4] == 0.0:
            bound[i], where[i, 0], where[i, 1], where[i, 2], in_rim = _cost(
                row, x, y, z, limits[0], limits[1], limits[2]
            )
            where[i, 3], where[i, 4] = 1.0 if in_rim else 0.0, 1.0
            continue
        bound[i] = np.inf
        w = 1.0
        if found:
            slope = _slope(cameras[best], row, where[best, 3] > 0, where[i, 3] > 0, x, y, z, cost - cheapest, limits)
            w = _weight(cost - cheapest, room, slope, limits[3])
        if w <= 0.0 or is_hidden(levels, layout, place, sharp, x, y, z, row[9] - x, row[10] - y, row[11] - z):
            continue
        if found == 0:
            best, cheapest = i, cost
            room = _room(row, cost, where[i, 3] > 0, z, limits[3])
        image[found], weight[found], us[found], vs[found] = i, w, where[i, 0], where[i, 1]
        scale[found] = row[12] / where[i, 2]
        total += w
        found += 1
    for k in range(found):
        weight[k] /= total


@njit(cache=True, nogil=True, inline="always")
def _room(row, cost, in_rim, z, half_width):  # type: ignore[no-untyped-def]
    """By how much a cost may exceed the best one's for the seam to be near: outside rims costs rise slowly."""
    share = CLOSE if in_rim else min(CLOSE, STEEPEST_RISE * half_width / (row[11] - z))
    return share * cost


@njit(cache=True, nogil=True, inline="always")
def _weight(difference, room, slope, half_width):  # type: ignore[no-untyped-def]
    """1 on the seam, 0 at the far end of its width."""
    t = difference / room
    if slope * half_width > 0.0:
        t = max(t, difference / (slope * half_width))
    elif difference > 0.0:
        return 0.0
    return (1.0 - t) * (1.0 - t) * (1.0 + 2.0 * t) if t < 1.0 else 0.0
