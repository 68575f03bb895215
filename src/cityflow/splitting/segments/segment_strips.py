"""Planes fitted to the strips of cells along lines, by least absolute deviations."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.kernels import njit
from cityflow.splitting.scores.medians import lower_median

LEFT, RIGHT, ACROSS = 0, 1, 2
"""As if columns were x and rows y."""
STATIONS, ROWS = 24, 5
"""Places along a line, and to one side of it, at which heights are looked up; more do not make it surer."""
ROUNDS = 4
INNER_CELLS, OUTER_CELLS, WIDE_CELLS = 1.0, 5.0, 14.0
"""A matched step is smeared over a cell or two: the nearest cells belong to neither side."""
NOISY_CELLS = 0.5
"""Where heights scatter by more than this, as on façades, a wider strip is tried."""
STILL_FLAT = 1.25
"""It is taken when it scatters by no more than this times what the narrow one does."""
ALIKE_CELLS = 3.5
"""Errors of matching are alike over about so many cells: only every so many count as independent."""
LEAST_KNOWN = 0.5


class Strips(NamedTuple):
    """Planes fitted to strips; NaN where less than half of a strip is known. Arrays of `strips` have an axis of `LEFT`, `RIGHT`, `ACROSS`.

    Attributes
    ----------
    z : (N, 2) heights on the line at start and end, metres
    scatter : (N,) robust standard deviation about the plane, metres
    slope : (N,) across the line, metres per metre, to the left
    independent : (N,) number of independent heights
    width : (N,) of the strip, metres
    """

    z: FloatArray
    scatter: FloatArray
    slope: FloatArray
    independent: FloatArray
    width: FloatArray

    def of(self, side: int) -> Strips:
        return Strips(
            self.z[:, side], self.scatter[:, side], self.slope[:, side], self.independent[:, side], self.width[:, side]
        )


def strips(dsm: Float32Array, ends: FloatArray, cell: float) -> Strips:
    """Of the left side, the right side, and both as one plane.

    Parameters
    ----------
    dsm : (rows, cols) float32, metres
    ends : (N, 2, 2) column and row of start and end, counted from the centre of the first cell
    """
    narrow = _strips(dsm, ends, cell, OUTER_CELLS)
    noisy = np.flatnonzero((narrow.scatter > NOISY_CELLS * cell).any(axis=1))
    wide = _strips(dsm, ends[noisy], cell, WIDE_CELLS)
    with np.errstate(invalid="ignore"):
        taken = (narrow.scatter[noisy] > NOISY_CELLS * cell) & (wide.scatter <= STILL_FLAT * narrow.scatter[noisy])
    line, side = noisy[np.nonzero(taken)[0]], np.nonzero(taken)[1]
    for whole, part in zip(narrow, wide, strict=True):
        whole[line, side] = part[taken]
    return narrow


@njit(cache=True, nogil=True)
def _heights(dsm: Float32Array, ends: FloatArray, outer: float) -> FloatArray:
    """(N, 2, STATIONS, ROWS, 3) of the centres of the cells met beside each line, on its left and its right, up to so many cells away: share of the way
    from the middle, cells to the left, and height in metres, NaN unknown."""
    found = np.empty((len(ends), 2, STATIONS, ROWS, 3))
    for n in range(len(ends)):
        (x0, y0), (x1, y1) = ends[n]
        length = max(math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)), 1e-6)
        x, y = (x1 - x0) / length, (y1 - y0) / length
        for side, station, k in np.ndindex(2, STATIONS, ROWS):
            s = length * ((station + 0.5) / STATIONS)
            w = (1 - 2 * side) * (INNER_CELLS + (outer - INNER_CELLS) * (k + 0.5) / ROWS)
            col, row = math.floor(x0 + s * x - w * y + 0.5), math.floor(y0 + s * y + w * x + 0.5)
            inside = 0 <= row < dsm.shape[0] and 0 <= col < dsm.shape[1]
            dx, dy = col - x0, row - y0
            place = found[n, side, station, k]
            place[0], place[1] = (dx * x + dy * y) / length - 0.5, dy * x - dx * y
            place[2] = dsm[row, col] if inside else np.nan
    return found


def _strips(dsm: Float32Array, ends: FloatArray, cell: float, outer: float) -> Strips:
    """With strips that reach so many cells to either side."""
    heights = _heights(dsm, ends, outer).reshape(len(ends), 2, STATIONS * ROWS, 3)
    start, end, scatter, slope, known = np.moveaxis(_planes(heights, 0.1 * cell), -1, 0)
    slope = slope / cell
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    width = (outer - INNER_CELLS) * np.array([1.0, 1.0, 2.0])
    independent = np.maximum(known * length[:, None] * width / ALIKE_CELLS**2, 1.0)
    every = Strips(
        np.stack([start, end], axis=2), scatter, slope, independent, np.broadcast_to(width * cell, known.shape)
    )
    there = known >= LEAST_KNOWN
    return Strips(*(np.where(there if a.ndim == 2 else there[..., None], a, np.nan) for a in every))


class Jumps(NamedTuple):
    """Where heights jump along a line, by side (N, 2): share of the way, height of the jump and its standard deviation, metres, 0 where not known; and
    (N,) how much higher the left side is."""

    share: FloatArray
    height: FloatArray
    sigma: FloatArray
    gap: FloatArray


def jumps(dsm: Float32Array, ends: FloatArray, least_cells: float) -> Jumps:
    """The step that explains most of what a straight course leaves, in medians across the strip; none nearer to an end than so many cells."""
    z = _heights(dsm, ends, OUTER_CELLS)[..., 2]
    places = (np.arange(STATIONS) + 0.5) / STATIONS
    axes = np.linalg.qr(np.column_stack([np.ones(STATIONS), places]))[0]
    steps = np.tri(STATIONS, STATIONS - 1, -1)
    steps -= axes @ (axes.T @ steps)
    square = (steps**2).sum(axis=0)
    margin = least_cells / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    near_end = np.minimum(places[1:], 1 - places[1:])[None] - 0.5 / STATIONS < margin[:, None]
    found, level = [], []
    for side in (LEFT, RIGHT):
        heights = z[:, side]
        course = lower_median(heights, np.isfinite(heights))
        known = np.isfinite(course)
        course = np.where(known, course, lower_median(course, known)[:, None])
        straight = course - (course @ axes) @ axes.T
        size = straight @ steps / square
        k = np.argmax(np.where(near_end, -1.0, size**2 * square), axis=1)
        height = np.take_along_axis(size, k[:, None], axis=1)[:, 0]
        sigma = 2.5 * np.abs(straight - height[:, None] * steps.T[k]).mean(axis=1)
        good = known.mean(axis=1) > LEAST_KNOWN
        level.append(np.where(good, course.mean(axis=1), np.nan))
        found.append((places[k] + 0.5 / STATIONS, np.where(good, height, 0.0), np.where(good, sigma, 0.0)))
    share, jump, spread = (np.stack(part, axis=1) for part in zip(*found, strict=True))
    return Jumps(share, jump, spread, level[0] - level[1])


@njit(cache=True, nogil=True)
def _planes(heights: FloatArray, floor: float) -> FloatArray:
    """(N, 2, M, 3) heights of both sides → (N, 3, 5) of the planes of left, right and both: height at start and end, scatter, slope for a cell, known share."""
    found = np.empty((len(heights), 3, 5))
    for n in range(len(heights)):
        for side in range(2):
            found[n, side] = _plane(heights[n, side], floor)
        found[n, ACROSS] = _plane(heights[n].reshape(-1, 3), floor)
    return found


@njit(cache=True, nogil=True)
def _plane(heights: FloatArray, floor: float) -> tuple[float, float, float, float, float]:
    """Of a plane by least absolute deviations: reweighted least squares from the median; smaller deviations than `floor` count as that."""
    known = heights[np.isfinite(heights[:, 2])]
    if len(known) == 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    middle = _lower_median(known[:, 2])
    a, b, c, off, weight = 0.0, 0.0, 0.0, np.empty(len(known)), np.ones(len(known))
    for _ in range(ROUNDS):
        w1 = wt = wu = wtt = wtu = wuu = r1 = rt = ru = 0.0
        for k in range(len(known)):
            t, u, w = known[k, 0], known[k, 1], weight[k]
            wz = w * (known[k, 2] - middle)
            w1, wt, wu, r1, rt, ru = w1 + w, wt + w * t, wu + w * u, r1 + wz, rt + wz * t, ru + wz * u
            wtt, wtu, wuu = wtt + w * t * t, wtu + w * t * u, wuu + w * u * u
        ridge = 1e-9 * max(w1, 1.0)
        # Cholesky's factors without roots: of one, of the way along, of the way across
        w1, wtt, wuu = w1 + ridge, wtt + ridge, wuu + ridge
        tt, tu, rt = wtt - wt * wt / w1, wtu - wt * wu / w1, rt - wt * r1 / w1
        c = (ru - wu * r1 / w1 - tu * rt / tt) / (wuu - wu * wu / w1 - tu * tu / tt)
        b = (rt - tu * c) / tt
        a = (r1 - wt * b - wu * c) / w1
        for k in range(len(known)):
            off[k] = abs(known[k, 2] - middle - a - b * known[k, 0] - c * known[k, 1])
            weight[k] = 1.0 / max(off[k], floor)
    return middle + a - 0.5 * b, middle + a + 0.5 * b, 1.4826 * _lower_median(off), c, len(known) / len(heights)


@njit(cache=True, nogil=True)
def _lower_median(values: FloatArray) -> float:
    return np.sort(values)[(len(values) - 1) // 2]
