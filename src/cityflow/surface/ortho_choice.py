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
    """The cost, and where the point is in the image."""
    base = _base_cost(row, x, y, z, steepest)
    if base == np.inf:
        return np.inf, 0.0, 0.0, 0.0
    u, v, depth = project(row, x, y, z)
    if depth <= 0.0:
        return np.inf, 0.0, 0.0, 0.0
    inside = min(min(u, row[24] - u), min(v, row[25] - v)) - margin
    if inside <= 0.0:
        return np.inf, 0.0, 0.0, 0.0
    t = min(1.0, inside / (rim * min(row[24], row[25])))
    return base / (t * (2.0 - t)), u, v, depth


@njit(cache=True, nogil=True)
def _seam_distance(row_a, row_b, x, y, z, difference, limits):  # type: ignore[no-untyped-def]
    """Metres to where both cost the same, to first order."""
    steepest, rim, margin = limits[0], limits[1], limits[2]
    ax = _cost(row_a, x + STEP_M, y, z, steepest, rim, margin)[0]
    bx = _cost(row_b, x + STEP_M, y, z, steepest, rim, margin)[0]
    ay = _cost(row_a, x, y + STEP_M, z, steepest, rim, margin)[0]
    by = _cost(row_b, x, y + STEP_M, z, steepest, rim, margin)[0]
    slope = np.hypot(bx - ax - difference, by - ay - difference) / STEP_M
    if not np.isfinite(slope):
        return np.inf
    return difference / max(slope, 1e-12)


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
    base = np.empty(n)
    for r in range(rows):
        for c in range(cols):
            z = heights[r, c]
            for k in range(out_image.shape[2]):
                out_image[r, c, k] = -1
            if np.isnan(z):
                continue
            x, y = xs[c], ys[r]
            for i in range(n):
                base[i] = _base_cost(cameras[i], x, y, z, limits[0])
            _fill_cell(
                base, x, y, z, cameras, levels, layout, place, sharp, limits,
                out_image[r, c], out_weight[r, c], out_u[r, c], out_v[r, c], out_scale[r, c],
            )  # fmt: skip


@njit(cache=True, nogil=True)
def _fill_cell(base, x, y, z, cameras, levels, layout, place, sharp, limits, image, weight, us, vs, scale):  # type: ignore[no-untyped-def]
    costs = np.empty(image.shape[0])
    found = 0
    while True:
        i = int(np.argmin(base))
        lower = base[i]
        # the list is complete once even the lower bound of what is left is dearer than all that may mix with the best
        if lower == np.inf or (found and lower >= costs[0] * (1.0 + CLOSE)):
            break
        base[i] = np.inf
        row = cameras[i]
        cost, u, v, depth = _cost(row, x, y, z, limits[0], limits[1], limits[2])
        if cost == np.inf or (found and cost >= costs[0] * (1.0 + CLOSE)):
            continue
        if found == image.shape[0] and cost >= costs[found - 1]:
            continue
        if is_hidden(levels, layout, place, sharp, x, y, z, row[9] - x, row[10] - y, row[11] - z):
            continue
        found = _insert(costs, image, us, vs, scale, found, cost, i, u, v, row[12] / depth)
    _weigh(costs, found, x, y, z, cameras, limits, image, weight)


@njit(cache=True, nogil=True)
def _insert(costs, image, us, vs, scale, found, cost, i, u, v, pixels):  # type: ignore[no-untyped-def]
    """Keep the cheapest, in order of cost, then of number."""
    k = min(found, image.shape[0] - 1)
    while k > 0 and (costs[k - 1] > cost or (costs[k - 1] == cost and image[k - 1] > i)):
        costs[k], image[k], us[k], vs[k], scale[k] = costs[k - 1], image[k - 1], us[k - 1], vs[k - 1], scale[k - 1]
        k -= 1
    costs[k], image[k], us[k], vs[k], scale[k] = cost, i, u, v, pixels
    return min(found + 1, image.shape[0])


@njit(cache=True, nogil=True)
def _weigh(costs, found, x, y, z, cameras, limits, image, weight):  # type: ignore[no-untyped-def]
    """Weights that fall from 1 at the best image's side of the seam to 0 at the far end of its width, made to add up to 1."""
    total = 0.0
    for k in range(found):
        w = 1.0
        if k:
            difference = costs[k] - costs[0]
            t = max(difference / (CLOSE * costs[0]), 0.0)
            if t < 1.0 and difference > 0.0:
                metres = _seam_distance(cameras[image[0]], cameras[image[k]], x, y, z, difference, limits)
                t = max(t, metres / limits[3])
            w = 0.0 if t >= 1.0 else (1.0 - t) * (1.0 - t) * (1.0 + 2.0 * t)
        weight[k] = w
        total += w
    for k in range(found):
        weight[k] /= total
        if weight[k] == 0.0:
            image[k] = -1
