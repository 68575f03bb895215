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
from cityflow.surface.ortho_camera import project
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


class _Looks(NamedTuple):
    """What is known so far of each image at one cell, each (N,).

    Attributes
    ----------
    bound : cost, or a lower bound of it, or infinite where the image has had its turn
    known : whether `bound` is the cost;  in_rim : whether the rim has a say
    u, v, depth : where the image sees the cell, once the cost is known
    """

    bound: FloatArray
    known: FloatArray
    in_rim: FloatArray
    u: FloatArray
    v: FloatArray
    depth: FloatArray


@njit(cache=True, nogil=True, inline="always")
def _base_cost(cameras, i, x, y, z, steepest):  # type: ignore[no-untyped-def]
    """Metres per pixel times slant, a lower bound of `_cost`; infinite where the ray is too flat."""
    dx, dy, h = cameras.centre[i, 0] - x, cameras.centre[i, 1] - y, cameras.centre[i, 2] - z
    if h <= 0.0:
        return np.inf
    slant = (dx * dx + dy * dy) / (h * h)
    if slant > steepest:
        return np.inf
    return h / cameras.focal[i, 0] * (1.0 + slant)


@njit(cache=True, nogil=True, inline="always")
def _cost(cameras, i, x, y, z, limits):  # type: ignore[no-untyped-def]
    """The cost, where the point is in the image, and whether the rim has a say."""
    base = _base_cost(cameras, i, x, y, z, limits.steepest)
    if base == np.inf:
        return np.inf, 0.0, 0.0, 0.0, False
    u, v, depth = project(cameras, i, x, y, z)
    if depth <= 0.0:
        return np.inf, 0.0, 0.0, 0.0, False
    width, height = cameras.size[i]
    inside = min(min(u, width - u), min(v, height - v)) - limits.margin
    if inside <= 0.0:
        return np.inf, 0.0, 0.0, 0.0, False
    t = min(1.0, inside / (limits.rim * min(width, height)))
    return base / (t * (2.0 - t)), u, v, depth, t < 1.0


@njit(cache=True, nogil=True)
def _cost_at(cameras, i, x, y, z, limits):  # type: ignore[no-untyped-def]
    """The cost alone; compiled once, where the projection four times in one function takes seven seconds."""
    return _cost(cameras, i, x, y, z, limits)[0]


@njit(cache=True, nogil=True)
def _slope(cameras, pair, in_rim, cell, difference, limits):  # type: ignore[no-untyped-def]
    """How fast the difference of two images' costs grows along the ground, per metre."""
    (a, b), (x, y, z) = pair, cell
    if not in_rim:
        (ax, ay, az), (bx, by, bz) = cameras.centre[a], cameras.centre[b]
        ha, hb = cameras.focal[a, 0] * (az - z), cameras.focal[b, 0] * (bz - z)
        return 2.0 * np.hypot((x - ax) / ha - (x - bx) / hb, (y - ay) / ha - (y - by) / hb)
    east = _cost_at(cameras, b, x + STEP_M, y, z, limits) - _cost_at(cameras, a, x + STEP_M, y, z, limits)
    north = _cost_at(cameras, b, x, y + STEP_M, z, limits) - _cost_at(cameras, a, x, y + STEP_M, z, limits)
    slope = np.hypot(east - difference, north - difference) / STEP_M
    return slope if np.isfinite(slope) else 0.0


@njit(cache=True, nogil=True)
def choose(xs, ys, heights, cameras, obstacles, limits, choice):  # type: ignore[no-untyped-def]
    """Fill the choice for each cell of a block; where heights are NaN there are no images."""
    rows, cols = heights.shape
    n = len(cameras.fisheye)
    looks = _Looks(np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n))
    for r in range(rows):
        for c in range(cols):
            z = heights[r, c]
            choice.image[r, c, :] = -1
            if np.isnan(z):
                continue
            for i in range(n):
                looks.bound[i] = _base_cost(cameras, i, xs[c], ys[r], z, limits.steepest)
                looks.known[i] = 0.0
            cell = Choice(choice.image[r, c], choice.weight[r, c], choice.u[r, c], choice.v[r, c], choice.scale[r, c])
            _fill_cell((xs[c], ys[r], z), cameras, obstacles, limits, looks, cell)


@njit(cache=True, nogil=True)
def _fill_cell(cell, cameras, obstacles, limits, looks, out):  # type: ignore[no-untyped-def]
    """Images in order of cost: lower bounds become costs when their turn comes, and only those that would mix are looked at from."""
    x, y, z = cell
    found, best, total = 0, 0, 0.0
    cheapest, room = np.inf, np.inf
    while found < out.image.shape[0]:
        i, cost = -1, np.inf
        for k in range(looks.bound.shape[0]):
            if looks.bound[k] < cost:
                i, cost = k, looks.bound[k]
        if i < 0 or cost >= cheapest + room:
            break
        if looks.known[i] == 0.0:
            looks.bound[i], looks.u[i], looks.v[i], looks.depth[i], in_rim = _cost(cameras, i, x, y, z, limits)
            looks.in_rim[i], looks.known[i] = 1.0 if in_rim else 0.0, 1.0
            continue
        looks.bound[i] = np.inf
        w = 1.0
        if found:
            in_rim = looks.in_rim[best] > 0 or looks.in_rim[i] > 0
            # as constants, which both are at first, they would be compiled once more
            slope = _slope(cameras, (int(best), int(i)), in_rim, cell, cost - cheapest, limits)
            w = _weight(cost - cheapest, room, slope, limits.half_width)
        to_x, to_y, to_z = cameras.centre[i]
        if w <= 0.0 or is_hidden(obstacles, x, y, z, to_x - x, to_y - y, to_z - z):
            continue
        if found == 0:
            best, cheapest = i, cost
            room = _room(to_z - z, cost, looks.in_rim[i] > 0, limits.half_width)
        out.image[found], out.weight[found], out.u[found], out.v[found] = i, w, looks.u[i], looks.v[i]
        out.scale[found] = cameras.focal[i, 0] / looks.depth[i]
        total += w
        found += 1
    for k in range(found):
        out.weight[k] /= total


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
