"""Selects the images that colour a cell, with weights.

An image's cost in a cell is the length on the ground that a pixel covers times the square of the slant (1 + tan²), which grows without bound towards the
rim of the picture. For images of one height and camera the cheapest one is the one whose nadir is nearest: seams are those of Voronoi
cells. The weight of a dearer image falls with its distance from the seam, which is the difference of the two costs over its slope; so nothing but the
cell itself, the images and the surface between cell and cameras has a say.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit
from cityflow.surface.ortho_camera import lens_of, project
from cityflow.surface.ortho_visibility import is_hidden

BLENDED = 4
"""Images that may mix in one cell; set by hand."""

CLOSE = 0.3
"""Images dearer than the best by this share never mix in, however steeply costs rise."""

STEEPEST_RISE = 8.0
"""Outside rims two costs draw apart by less than this share of them for each height of flight: 2 · (tan 60° + tan 60°), and a bit."""

STEP_M = 0.5
"""Of the difference quotient along the ground."""


class Limits(NamedTuple):
    """What an image may be asked for.

    Attributes
    ----------
    steepest : greatest tan² off the frame's nadir
    rim : width of the rim as a share of the image
    margin : pixels along the edge that are not used
    half_width : of a seam, metres
    """

    steepest: float
    rim: float
    margin: float
    half_width: float


class Choice(NamedTuple):
    """(rows, cols, BLENDED) images, weights, image coordinates and pixels per metre of a block; images of -1 are none, weights of a cell add up to 1."""

    image: np.ndarray[tuple[int, ...], np.dtype[np.int32]]
    weight: FloatArray
    u: FloatArray
    v: FloatArray
    scale: FloatArray


RUN = 128
"""Cells of a row that are looked at together: none of a block is longer."""
LOOK, COST, U, V, DEPTH, RIM = 5 * RUN, 0, RUN, 2 * RUN, 3 * RUN, 4 * RUN
"""Of an image, as far as it shows the cells of a row: its cost, infinite where it does not or has had its turn, then these; `RIM` is 1 far from the
rim of the image and less where that has a say."""


@njit(cache=True, nogil=True, inline="always", error_model="numpy")
def _cost(lens, fisheye, size, x, y, z, limits):  # type: ignore[no-untyped-def]
    """Metres per pixel times slant, and dearer in the rim; infinite where the ray is too flat or the image does not show the place.

    Then image coordinates, depth, and 1 outside the rim. `limits` are those of `Limits` without the last; `size` is width and height.
    """
    (steepest, rim, margin), (width, height), (x_0, y_0, z_0) = limits, size, lens[0]
    dx, dy, h = x_0 - x, y_0 - y, z_0 - z
    slant = (dx * dx + dy * dy) / (h * h)
    u, v, depth = project(lens, fisheye, x, y, z)
    from_right, from_below, side = width - u, height - v, width if width < height else height
    across, down = u if u < from_right else from_right, v if v < from_below else from_below
    inside = (across if across < down else down) - margin
    t = inside / (rim * side)
    t = t if t < 1.0 else 1.0
    shown = (h > 0.0) & (slant <= steepest) & (depth > 0.0) & (inside > 0.0)
    cost = h / lens[3][0] * (1.0 + slant) / (t * (2.0 - t))
    return cost if shown else np.inf, u, v, depth, t


@njit(cache=True, nogil=True, error_model="numpy")
def _costs(lens, size, xs, y, heights, limits, look):  # type: ignore[no-untyped-def]
    """Of an image that is no fisheye, along a row: without a branch and with all in one array, so that the loop becomes vector instructions."""
    for c in range(len(xs)):
        cost, u, v, depth, t = _cost(lens, False, size, xs[c], y, heights[c], limits)
        look[c + COST], look[c + U], look[c + V], look[c + DEPTH], look[c + RIM] = cost, u, v, depth, t


@njit(cache=True, nogil=True, error_model="numpy")
def _fisheye_costs(lens, size, xs, y, heights, limits, look):  # type: ignore[no-untyped-def]
    for c in range(len(xs)):
        cost, u, v, depth, t = _cost(lens, True, size, xs[c], y, heights[c], limits)
        look[c + COST], look[c + U], look[c + V], look[c + DEPTH], look[c + RIM] = cost, u, v, depth, t


@njit(cache=True, nogil=True)
def _cost_at(cameras, i, x, y, z, limits):  # type: ignore[no-untyped-def]
    """The cost alone; compiled once, where the projection four times in one function takes seven seconds."""
    size, asked = (cameras.size[i, 0], cameras.size[i, 1]), (limits.steepest, limits.rim, limits.margin)
    return _cost(lens_of(cameras, i), cameras.fisheye[i], size, x, y, z, asked)[0]


@njit(cache=True, nogil=True)
def _slope(cameras, pair, in_rim, cell, difference, limits):  # type: ignore[no-untyped-def]
    """How fast the difference of two images' costs grows along the ground, per metre."""
    (a, b), (x, y, z) = pair, cell
    if not in_rim:
        at = cameras.centre
        ha, hb = cameras.focal[a, 0] * (at[a, 2] - z), cameras.focal[b, 0] * (at[b, 2] - z)
        return 2.0 * np.hypot((x - at[a, 0]) / ha - (x - at[b, 0]) / hb, (y - at[a, 1]) / ha - (y - at[b, 1]) / hb)
    east = _cost_at(cameras, b, x + STEP_M, y, z, limits) - _cost_at(cameras, a, x + STEP_M, y, z, limits)
    north = _cost_at(cameras, b, x, y + STEP_M, z, limits) - _cost_at(cameras, a, x, y + STEP_M, z, limits)
    slope = np.hypot(east - difference, north - difference) / STEP_M
    return slope if np.isfinite(slope) else 0.0


@njit(cache=True, nogil=True)
def choose(xs, ys, heights, cameras, obstacles, limits, choice):  # type: ignore[no-untyped-def]
    """Fill the choice for each cell of a block; where heights are NaN there are no images."""
    rows, cols = heights.shape
    n = len(cameras.fisheye)
    looks, asked = np.empty(n * LOOK), (limits.steepest, limits.rim, limits.margin)
    for r in range(rows):
        for i in range(n):
            lens, size, look = lens_of(cameras, i), (cameras.size[i, 0], cameras.size[i, 1]), looks[i * LOOK :]
            if cameras.fisheye[i]:
                _fisheye_costs(lens, size, xs, ys[r], heights[r], asked, look)
            else:
                _costs(lens, size, xs, ys[r], heights[r], asked, look)
        for c in range(cols):
            for k in range(BLENDED):
                choice.image[r, c, k] = -1
            if not np.isnan(heights[r, c]):
                _fill_cell((r, c), (xs[c], ys[r], heights[r, c]), cameras, obstacles, limits, looks, choice)


@njit(cache=True, nogil=True, inline="always")
def _fill_cell(place, cell, cameras, obstacles, limits, looks, out):  # type: ignore[no-untyped-def]
    """Images in order of cost; only those that would mix are looked at from."""
    (r, c), (x, y, z) = place, cell
    found, best, total = 0, 0, 0.0
    cheapest, room = np.inf, np.inf
    while found < BLENDED:
        i, cost = -1, np.inf
        for k in range(len(cameras.fisheye)):
            if looks[k * LOOK + c] < cost:
                i, cost = k, looks[k * LOOK + c]
        if i < 0 or cost >= cheapest + room:
            break
        looks[i * LOOK + c] = np.inf
        w = 1.0
        if found:
            in_rim = looks[best * LOOK + RIM + c] < 1.0 or looks[i * LOOK + RIM + c] < 1.0
            # as constants, which both are at first, they would be compiled once more
            slope = _slope(cameras, (int(best), int(i)), in_rim, cell, cost - cheapest, limits)
            w = _weight(cost - cheapest, room, slope, limits.half_width)
        to_x, to_y, to_z = cameras.centre[i, 0], cameras.centre[i, 1], cameras.centre[i, 2]
        if w <= 0.0 or is_hidden(obstacles, x, y, z, to_x - x, to_y - y, to_z - z):
            continue
        if found == 0:
            best, cheapest = i, cost
            room = _room(to_z - z, cost, looks[i * LOOK + RIM + c] < 1.0, limits.half_width)
        out.image[r, c, found], out.weight[r, c, found] = i, w
        out.u[r, c, found], out.v[r, c, found] = looks[i * LOOK + U + c], looks[i * LOOK + V + c]
        out.scale[r, c, found] = cameras.focal[i, 0] / looks[i * LOOK + DEPTH + c]
        total += w
        found += 1
    for k in range(found):
        out.weight[r, c, k] /= total


@njit(cache=True, nogil=True, inline="always")
def _room(above, cost, in_rim, half_width):  # type: ignore[no-untyped-def]
    """By how much a cost may exceed the best one's for the seam to be near: outside rims costs rise slowly."""
    share = CLOSE if in_rim else min(CLOSE, STEEPEST_RISE * half_width / above)
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
