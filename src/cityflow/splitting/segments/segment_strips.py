"""Planes fitted to the strips of cells along lines, by least absolute deviations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.splitting.scores.medians import lower_median

LEFT, RIGHT, ACROSS = 0, 1, 2
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
    slope : (N,) across the line, metres per metre, to the right
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


class _Heights(NamedTuple):
    """(N, M) heights beside lines, NaN unknown: share of the way from the middle, cells to the right, metres; (M,) on the left."""

    t: FloatArray
    u: FloatArray
    z: FloatArray
    left: BoolArray


def _heights(dsm: Float32Array, ends: FloatArray, outer: float) -> _Heights:
    """Of the centres of the cells met at `STATIONS` places along each line, `ROWS` to either side up to so many cells away."""
    along = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-6)[:, None]
    x, y = (along / length).T[..., None]
    off = INNER_CELLS + (outer - INNER_CELLS) * (np.arange(ROWS) + 0.5) / ROWS
    s = length * np.repeat((np.arange(STATIONS) + 0.5) / STATIONS, 2 * ROWS)
    w = np.tile(np.concatenate([off, -off]), STATIONS)
    col = np.floor(ends[:, 0, :1] + s * x - w * y + 0.5).astype(np.int64)
    row = np.floor(ends[:, 0, 1:] + s * y + w * x + 0.5).astype(np.int64)
    inside = (row >= 0) & (col >= 0) & (row < dsm.shape[0]) & (col < dsm.shape[1])
    z = np.where(inside, dsm[np.where(inside, row, 0), np.where(inside, col, 0)], np.nan).astype(np.float64)
    dx, dy = col - ends[:, 0, :1], row - ends[:, 0, 1:]
    return _Heights((dx * x + dy * y) / length - 0.5, dy * x - dx * y, z, w > 0)


def _strips(dsm: Float32Array, ends: FloatArray, cell: float, outer: float) -> Strips:
    """With strips that reach so many cells to either side."""
    t, u, z, left = _heights(dsm, ends, outer)
    parts = [_fit(t[:, of], u[:, of], z[:, of], cell) for of in (left, ~left, np.ones(len(left), bool))]
    start, end, scatter, slope, known = (np.stack(p, axis=1) for p in zip(*parts, strict=True))
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
    _, _, z, left = _heights(dsm, ends, OUTER_CELLS)
    places = (np.arange(STATIONS) + 0.5) / STATIONS
    axes = np.linalg.qr(np.column_stack([np.ones(STATIONS), places]))[0]
    steps = np.tri(STATIONS, STATIONS - 1, -1)
    steps -= axes @ (axes.T @ steps)
    square = (steps**2).sum(axis=0)
    margin = least_cells / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    near_end = np.minimum(places[1:], 1 - places[1:])[None] - 0.5 / STATIONS < margin[:, None]
    found, level = [], []
    for side in (left, ~left):
        heights = z[:, side].reshape(len(z), STATIONS, ROWS)
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


def _fit(t: FloatArray, u: FloatArray, z: FloatArray, cell: float) -> tuple[FloatArray, ...]:
    """(N,) each: height at start and end, scatter, slope, and known share of planes by least absolute deviations: reweighted least squares from the median."""
    known = np.isfinite(z)
    middle = np.nan_to_num(lower_median(z, known))
    values = np.where(known, z - middle[:, None], 0.0)
    axes = np.stack([np.ones_like(t), t, u], axis=2)
    weight, plane = known.astype(np.float64), np.zeros((len(z), 3))
    for _ in range(ROUNDS):
        weighted = (axes * weight[..., None]).transpose(0, 2, 1)
        normal = weighted @ axes + 1e-9 * np.maximum(weight.sum(axis=1), 1.0)[:, None, None] * np.eye(3)
        plane = np.linalg.solve(normal, weighted @ values[..., None])[..., 0]
        off = np.abs(values - (axes @ plane[..., None])[..., 0])
        weight = known / np.maximum(off, 0.1 * cell)
    a, b, c = plane.T
    scatter = 1.4826 * np.nan_to_num(lower_median(off, known))
    return middle + a - 0.5 * b, middle + a + 0.5 * b, scatter, c / cell, known.mean(axis=1)
