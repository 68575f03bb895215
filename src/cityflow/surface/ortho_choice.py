"""Selects the images that colour a cell, with weights.

An image's cost in a cell is the length on the ground that a pixel covers times the square of the slant (1 + tan²), which grows without bound towards the
rim of the picture. For images of one height and camera the cheapest one is the one whose nadir is nearest: seams are those of Voronoi
cells. The weight of a dearer image falls with its distance from the seam, which is the difference of the two costs over its slope; so nothing but the
cell itself, the images and the surface between cell and cameras has a say.

Cells side by side are decided together where no step is between them: what an image costs, and whether something hides it, hardly differs.
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
    """(rows, cols, BLENDED) images, weights, image coordinates and pixels per metre of a block; images of -1 are none, and say nothing else; weights of a
    cell add up to 1."""

    image: np.ndarray[tuple[int, ...], np.dtype[np.int32]]
    weight: FloatArray
    u: FloatArray
    v: FloatArray
    scale: FloatArray


class Places(NamedTuple):
    """Cells that are decided together, and where the choice has their first.

    Attributes
    ----------
    x, y : of columns and rows, metres;  heights : (rows, cols) metres; NaN where nothing is
    edge : so many rows and columns have one choice, where no step is between
    smooth : their heights differ by no more, metres
    row, col : of the first cell
    """

    x: FloatArray
    y: FloatArray
    heights: FloatArray
    edge: int
    smooth: float
    row: int
    col: int


RUN = 128
"""Cells of a row that are looked at together: none of a block is longer."""
LOOK, COST, RIM = 2 * RUN, 0, RUN
"""Of an image, as far as it shows what is decided together in some rows: its cost, infinite where it does not, then `RIM`, which is 1 far from the rim of
the image and less where that has a say."""


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
        cost, _, _, _, t = _cost(lens, False, size, xs[c], y, heights[c], limits)
        look[c + COST], look[c + RIM] = cost, t


@njit(cache=True, nogil=True, error_model="numpy")
def _fisheye_costs(lens, size, xs, y, heights, limits, look):  # type: ignore[no-untyped-def]
    for c in range(len(xs)):
        cost, _, _, _, t = _cost(lens, True, size, xs[c], y, heights[c], limits)
        look[c + COST], look[c + RIM] = cost, t


@njit(cache=True, nogil=True)
def _pixel_at(cameras, i, x, y, z):  # type: ignore[no-untyped-def]
    """Image coordinates and depth; compiled once, as the next."""
    return project(lens_of(cameras, i), cameras.fisheye[i], x, y, z)


@njit(cache=True, nogil=True)
def _look_at(cameras, i, x, y, z, limits):  # type: ignore[no-untyped-def]
    """Cost and rim; compiled once, where the projection four times in one function takes seven seconds."""
    size, asked = (cameras.size[i, 0], cameras.size[i, 1]), (limits.steepest, limits.rim, limits.margin)
    cost, _, _, _, t = _cost(lens_of(cameras, i), cameras.fisheye[i], size, x, y, z, asked)
    return cost, t


@njit(cache=True, nogil=True)
def _slope(cameras, pair, in_rim, cell, difference, limits):  # type: ignore[no-untyped-def]
    """How fast the difference of two images' costs grows along the ground, per metre."""
    (a, b), (x, y, z) = pair, cell
    if not in_rim:
        at = cameras.centre
        ha, hb = cameras.focal[a, 0] * (at[a, 2] - z), cameras.focal[b, 0] * (at[b, 2] - z)
        return 2.0 * np.hypot((x - at[a, 0]) / ha - (x - at[b, 0]) / hb, (y - at[a, 1]) / ha - (y - at[b, 1]) / hb)
    east = _look_at(cameras, b, x + STEP_M, y, z, limits)[0] - _look_at(cameras, a, x + STEP_M, y, z, limits)[0]
    north = _look_at(cameras, b, x, y + STEP_M, z, limits)[0] - _look_at(cameras, a, x, y + STEP_M, z, limits)[0]
    slope = np.hypot(east - difference, north - difference) / STEP_M
    return slope if np.isfinite(slope) else 0.0


@njit(cache=True, nogil=True)
def choose(places, cameras, numbers, obstacles, limits, choice):  # type: ignore[no-untyped-def]
    """Fill the choice for each cell of a block; where heights are NaN there are no images. `numbers` are those of the cameras."""
    rows, cols = places.heights.shape
    n, edge = len(cameras.fisheye), places.edge
    wide = (cols + edge - 1) // edge
    looks, asked = np.empty(n * LOOK), (limits.steepest, limits.rim, limits.margin)
    found = looks, np.empty(n), np.empty(n), np.empty(BLENDED, np.int64), np.empty(BLENDED), np.empty(BLENDED, np.int64)
    middle, height, rough = np.empty(wide), np.empty(wide), np.empty(wide)
    for r in range(0, rows, edge):
        y = _together(places, r, middle, height, rough)
        for i in range(n):
            lens, size, look = lens_of(cameras, i), (cameras.size[i, 0], cameras.size[i, 1]), looks[i * LOOK :]
            if cameras.fisheye[i]:
                _fisheye_costs(lens, size, middle, y, height, asked, look)
            else:
                _costs(lens, size, middle, y, height, asked, look)
        for b in range(wide):
            at, place = (r, b), (middle[b], y, height[b])
            _fill_cells(at, place, rough[b], places, (cameras, numbers), obstacles, limits, (found, choice))


@njit(cache=True, nogil=True)
def _together(places, r, middle, height, rough):  # type: ignore[no-untyped-def]
    """Middles, mean heights and their differences of what is decided together in the rows from `r` on; returns the y of the middles."""
    heights, edge = places.heights, places.edge
    last = min(r + edge, heights.shape[0])
    for b in range(len(middle)):
        first, end = b * edge, min((b + 1) * edge, heights.shape[1])
        middle[b] = 0.5 * (places.x[first] + places.x[end - 1])
        total, count, low, high = 0.0, 0, np.inf, -np.inf
        for i in range(r, last):
            for j in range(first, end):
                z = heights[i, j]
                if not np.isnan(z):
                    total, count, low, high = total + z, count + 1, min(low, z), max(high, z)
        height[b], rough[b] = total / count if count else np.nan, high - low
    return 0.5 * (places.y[r] + places.y[last - 1])


@njit(cache=True, nogil=True, inline="always")
def _fill_cells(at, middle, rough, places, images, obstacles, limits, kept):  # type: ignore[no-untyped-def]
    """What is decided together: once, or where a step is in it, from each cell by itself."""
    (r, b), edge, heights = at, places.edge, places.heights
    (cameras, numbers), (looks, out) = images, kept
    is_smooth, seen, found, shared = rough <= places.smooth, -1, 0, looks[5]
    for i in range(r, min(r + edge, heights.shape[0])):
        for j in range(b * edge, min((b + 1) * edge, heights.shape[1])):
            row, col, z = places.row + i, places.col + j, heights[i, j]
            for k in range(BLENDED):
                out.image[row, col, k] = -1
            if np.isnan(z):
                continue
            x, y = places.x[j], places.y[i]
            if seen < 0 or not is_smooth:
                _look_from(b, looks)
                seen = _decide(middle, middle if is_smooth else (x, y, z), True, cameras, obstacles, limits, looks)
                found, shared[:] = seen, looks[3]
            if seen > 1 and is_smooth and edge > 1:
                # what mixes has weights of its own in each cell
                _look_closely(shared[:seen], (x, y, z), cameras, limits, looks)
                found = _decide((x, y, z), (x, y, z), False, cameras, obstacles, limits, looks)
            for k in range(found):
                c = looks[3][k]
                u, v, depth = _pixel_at(cameras, c, x, y, z)
                out.image[row, col, k], out.weight[row, col, k] = numbers[c], looks[4][k]
                out.u[row, col, k], out.v[row, col, k], out.scale[row, col, k] = u, v, cameras.focal[c, 0] / depth


@njit(cache=True, nogil=True)
def _is_shown(cameras, i, cell, margin):  # type: ignore[no-untyped-def]
    u, v, depth = _pixel_at(cameras, i, cell[0], cell[1], cell[2])
    return depth > 0.0 and margin < u < cameras.size[i, 0] - margin and margin < v < cameras.size[i, 1] - margin


@njit(cache=True, nogil=True, inline="always")
def _look_from(b, looks):  # type: ignore[no-untyped-def]
    """Costs and rims of all images in the middle of what is decided together."""
    look, cost, rim = looks[:3]
    for k in range(len(cost)):
        cost[k], rim[k] = look[k * LOOK + COST + b], look[k * LOOK + RIM + b]


@njit(cache=True, nogil=True)
def _look_closely(seen, cell, cameras, limits, looks):  # type: ignore[no-untyped-def]
    """Costs and rims of some images in a cell; no others have a turn."""
    cost, rim = looks[1], looks[2]
    cost[:] = np.inf
    for i in seen:
        cost[i], rim[i] = _look_at(cameras, i, cell[0], cell[1], cell[2], limits)


@njit(cache=True, nogil=True)
def _decide(middle, cell, looks_out, cameras, obstacles, limits, looks):  # type: ignore[no-untyped-def]
    """Number of images found, in order of their costs, which are those in `middle`; `looks_out`: only those that see the cell, if they would mix."""
    (_, turn, rim, image, weight, _), (x, y, z) = looks, cell
    found, best, total = 0, 0, 0.0
    cheapest, room = np.inf, np.inf
    while found < BLENDED:
        i, cost = -1, np.inf
        for k in range(len(turn)):
            if turn[k] < cost:
                i, cost = k, turn[k]
        if i < 0 or cost >= cheapest + room:
            break
        turn[i] = np.inf
        w = 1.0
        if found:
            in_rim = rim[best] < 1.0 or rim[i] < 1.0
            # as constants, which both are at first, they would be compiled once more
            slope = _slope(cameras, (int(best), int(i)), in_rim, middle, cost - cheapest, limits)
            w = _weight(cost - cheapest, room, slope, limits.half_width)
        to_x, to_y, to_z = cameras.centre[i, 0], cameras.centre[i, 1], cameras.centre[i, 2]
        if w <= 0.0 or (looks_out and is_hidden(obstacles, x, y, z, to_x - x, to_y - y, to_z - z)):
            continue
        # what stands higher or lower than the middle may lie beyond the edge of the picture
        if z != middle[2] and not _is_shown(cameras, int(i), cell, limits.margin):
            continue
        if found == 0:
            best, cheapest = i, cost
            room = _room(to_z - z, cost, rim[i] < 1.0, limits.half_width)
        image[found], weight[found] = i, w
        total += w
        found += 1
    for k in range(found):
        weight[k] /= total
    return found


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
