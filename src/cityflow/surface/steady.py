"""Averages the fused surface over as much of its surroundings as the noise of the depth maps demands, and no further than one plane reaches.

How noisy a height is, the images tell: each has its own errors, so their depths scatter around the surface that they share. What all of them
show alike is no noise, however rough it is. A cell is averaged with planes of wider and wider windows (taps two, four and eight cells apart).
A tap counts if its height lies on the cell's plane within the noise of both. A wider window is taken only while its height lies within the
confidence intervals of all narrower ones (Lepski's rule): the first that does not shows that the surface is no plane there.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.surface.fuse_cells import CellPoints

STEPS = (2, 4, 8)
"""Cells between the taps of a window of 5 x 5 taps; the plane of each cell is that of the window before."""
TAPS = 2
"""Taps to each side."""
REACH_CELLS = TAPS * sum(STEPS) + TAPS + 2
"""A steadied height depends on heights and noise so far around."""
SURE = 2.5
"""Half a confidence interval, standard deviations: 99 % of normal errors."""
IN_COMMON = 0.6
"""Share of their variance that the taps of a window have in common: matching has its own windows, so errors of neighbours go together (autocorrelation of
the errors of a spoiled flight, seed 921: 0.7 two cells apart, 0.5 four, 0.3 eight)."""
LEAST_NOISE_CELLS = 0.05
"""A height is not known better than this, cells."""
ROUNDS = 3
"""Of re-weighting a plane."""
SUMS = 10
"""Of a cell: weights, then weights times x, y, z, xx, xy, yy, xz, yz, and squares of the weights."""
STIFF = 0.05
"""Weight of the former slope in a plane, as the square of the distance of taps: a lone row of taps has no tilt of its own."""


def noise_of(points: CellPoints, z: FloatArray, band: float) -> Float32Array:
    """(rows, cols) standard deviation of the mean height of a cell, from how its images differ, in the units of z; NaN where fewer than two show it.

    Parameters
    ----------
    points : in cells, as fused
    z : (rows, cols) the surface;  band : points farther from it belong to another
    """
    images = int(points.image.max()) + 1 if len(points.image) else 0
    return np.asarray(_noise(points, z, band, images))


@njit(cache=True, nogil=True)
def _noise(points, z, band, images):  # type: ignore[no-untyped-def]
    start, u, v, height, quality, image = points.start, points.u, points.v, points.z, points.quality, points.image
    rows, cols = z.shape
    out = np.full(z.shape, np.nan, np.float32)
    total, weight, seen = np.zeros(images), np.zeros(images), np.empty(images, np.int64)
    for r in range(rows):
        for c in range(cols):
            k, h = r * cols + c, z[r, c]
            if np.isnan(h) or start[k + 1] - start[k] < 2:
                continue
            east = _slope(z[r, c - 1] if c > 0 else np.nan, h, z[r, c + 1] if c + 1 < cols else np.nan, band)
            south = _slope(z[r - 1, c] if r > 0 else np.nan, h, z[r + 1, c] if r + 1 < rows else np.nan, band)
            n = 0
            for i in range(start[k], start[k + 1]):
                off = height[i] - h - east * u[i] - south * v[i]
                if abs(off) > band:
                    continue
                if weight[image[i]] == 0.0:
                    seen[n] = image[i]
                    n += 1
                total[image[i]] += quality[i] * off
                weight[image[i]] += quality[i]
            out[r, c] = _of_mean(total, weight, seen, n)
            for m in range(n):
                total[seen[m]], weight[seen[m]] = 0.0, 0.0
    return out


@njit(cache=True, nogil=True)
def _slope(before: float, here: float, after: float, most: float) -> float:
    """Of a raster, by its neighbours on both sides, or on one, or none where there is a step."""
    a, b = here - before, after - here
    first, second = abs(a) <= most, abs(b) <= most
    if first and second:
        return (a + b) / 2
    return a if first else b if second else 0.0


@njit(cache=True, nogil=True)
def _of_mean(total: FloatArray, weight: FloatArray, seen: IntArray, n: int) -> float:
    """Standard deviation of the weighted mean of `n` images, each with its sum and weight."""
    if n < 2:
        return np.nan
    sums, weights, squares = 0.0, 0.0, 0.0
    for m in range(n):
        w = weight[seen[m]]
        sums, weights, squares = sums + total[seen[m]], weights + w, squares + w * w
    mean, spread = sums / weights, 0.0
    for m in range(n):
        w = weight[seen[m]]
        spread += w * (total[seen[m]] / w - mean) ** 2
    # as many images of the same weight would say as much
    return np.sqrt(spread / weights / max(weights * weights / squares - 1.0, 0.25))


def steadied(z: Float32Array, noise: Float32Array, cell: float) -> Float32Array:
    """(rows, cols) heights averaged over windows as wide as noise demands and one plane reaches; NaN where z is. As `steadied_and_taken`."""
    return steadied_and_taken(z, noise, cell)[0]


def steadied_and_taken(z: Float32Array, noise: Float32Array, cell: float) -> tuple[Float32Array, ByteArray]:
    """Heights averaged over windows as wide as noise demands and one plane reaches, NaN where z is; and how many of the windows each cell took.

    Both (rows, cols). A cell that took few stands where the images show a surface that is no plane.

    Cells nearer than `REACH_CELLS` to the edge may differ from those of a larger raster.

    Parameters
    ----------
    z : (rows, cols) float32, metres, NaN in holes;  noise : (rows, cols) float32, metres, NaN where unknown (`noise_of`)
    cell : metres
    """
    z, noise = np.ascontiguousarray(z), np.ascontiguousarray(noise)
    known = np.isfinite(z)
    variance = _local_variance(noise, np.float32(LEAST_NOISE_CELLS * cell), np.float32(cell))
    east, south = _first_slopes(z, np.float32(cell))
    height, spread = np.where(known, z, np.float32(0)), np.float32(SURE) * np.sqrt(variance)
    low, high, going = height - spread, height + spread, known.copy()
    taken = np.zeros(z.shape, np.uint8)
    for step in STEPS:
        edge = TAPS * step
        wide = np.pad(height, edge)
        weight = np.pad(np.where(known, 1 / variance, np.float32(0)), edge)
        rough = np.pad(variance, edge, mode="edge")
        _average((wide, weight, rough), (height, east, south, variance), (low, high, going), step)
        taken += going
    return np.where(known, height, np.float32(np.nan)), taken


@njit(cache=True, nogil=True)
def _local_variance(noise: Float32Array, least: np.float32, unknown: np.float32) -> Float32Array:
    """(rows, cols) mean square over 5 x 5 cells: a few images say little in one cell. Where no cell around says anything, that of `unknown`."""
    rows, cols = noise.shape
    out = np.empty(noise.shape, np.float32)
    for r in range(rows):
        for c in range(cols):
            n, total = 0, np.float32(0)
            for i in range(max(r - 2, 0), min(r + 3, rows)):
                for j in range(max(c - 2, 0), min(c + 3, cols)):
                    s = noise[i, j]
                    if not np.isnan(s):
                        n, total = n + 1, total + s * s
            out[r, c] = max(total / np.float32(n), least * least) if n > 0 else unknown * unknown
    return out


@njit(cache=True, nogil=True)
def _first_slopes(z: Float32Array, most: np.float32) -> tuple[Float32Array, Float32Array]:
    """Slopes eastwards and southwards, metres a cell; no steeper than `most`, else a step."""
    rows, cols = z.shape
    east, south = np.zeros(z.shape, np.float32), np.zeros(z.shape, np.float32)
    none = np.float32(np.nan)
    for r in range(rows):
        for c in range(cols):
            if np.isnan(z[r, c]):
                continue
            east[r, c] = _slope(z[r, c - 1] if c > 0 else none, z[r, c], z[r, c + 1] if c + 1 < cols else none, most)
            south[r, c] = _slope(z[r - 1, c] if r > 0 else none, z[r, c], z[r + 1, c] if r + 1 < rows else none, most)
    return east, south


@njit(cache=True, nogil=True, error_model="numpy")
def _average(taps, own, limits, step):  # type: ignore[no-untyped-def]
    """Average cells in place by the planes through their taps.

    Parameters
    ----------
    taps : heights, weights and variances, wider than the cells by `TAPS` steps to each side
    own : heights, slopes eastwards and southwards, and variances of the cells
    limits : lowest and highest height that narrower windows allow, and whether the cell still widens its window
    """
    height, east, south, variance = own
    low, high, going = limits
    rows, cols = height.shape
    zero, one, size = np.float32(0), np.float32(1), np.float32(step)
    sums, plane = np.empty((SUMS, cols), np.float32), np.empty((3, cols), np.float32)
    for r in range(rows):
        first, last = _going_part(going[r])
        if first == last:
            continue
        own, many = slice(first, last), slice(0, last - first)
        plane[0, many], plane[1, many], plane[2, many] = zero, east[r, own] * size, south[r, own] * size
        for _ in range(ROUNDS):
            sums[:] = zero
            for k in range(-TAPS, TAPS + 1):
                for m in range(-TAPS, TAPS + 1):
                    at = (TAPS + m) * step
                    row = r + (TAPS + k) * step
                    tap = slice(at + first, at + last)
                    near = np.float32(1.0 - (k * k + m * m) / ((TAPS + 1.0) * (TAPS + 1.0)))
                    _add(
                        (taps[0][row, tap], taps[1][row, tap], taps[2][row, tap]),
                        (np.float32(m), np.float32(k), near),
                        height[r, own],
                        variance[r, own],
                        plane,
                        sums,
                    )
            _solve(sums, plane, going[r, own])
        for c in range(first, last):
            n = sums[0, c - first]
            new = height[r, c] + plane[0, c - first]
            going[r, c] = going[r, c] and n > zero and low[r, c] <= new and new <= high[r, c]
            if going[r, c]:
                height[r, c], east[r, c], south[r, c] = new, plane[1, c - first] / size, plane[2, c - first] / size
                variance[r, c] *= np.float32(IN_COMMON) + np.float32(1 - IN_COMMON) * min(
                    sums[9, c - first] / (n * n), one
                )
                sure = np.float32(SURE) * np.sqrt(variance[r, c])
                low[r, c], high[r, c] = max(low[r, c], new - sure), min(high[r, c], new + sure)


@njit(cache=True, nogil=True)
def _going_part(going: BoolArray) -> tuple[int, int]:
    """The part of a row from the first cell that still widens its window to the last."""
    first, last = 0, len(going)
    while first < last and not going[first]:
        first += 1
    while first < last and not going[last - 1]:
        last -= 1
    return first, last


@njit(cache=True, nogil=True, error_model="numpy")
def _add(tap, place, height, variance, plane, sums):  # type: ignore[no-untyped-def]
    """Add a tap of each cell of a row to its sums, weighted by precision, nearness and distance from the plane of the round before."""
    z, weight, rough = tap
    x, y, near = place
    zero, one, sure = np.float32(0), np.float32(1), np.float32(1 / (SURE * SURE))
    for c in range(len(height)):
        d = z[c] - height[c]
        off = d - plane[0, c] - plane[1, c] * x - plane[2, c] * y
        within = one - off * off * sure / (rough[c] + variance[c])
        within = within if within > zero else zero
        w = near * within * within * weight[c]
        sums[0, c] += w
        sums[1, c] += w * x
        sums[2, c] += w * y
        sums[3, c] += w * d
        sums[4, c] += w * x * x
        sums[5, c] += w * x * y
        sums[6, c] += w * y * y
        sums[7, c] += w * x * d
        sums[8, c] += w * y * d
        sums[9, c] += w * w


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(sums, plane, going):  # type: ignore[no-untyped-def]
    """Planes from sums; a cell without any weight keeps its own."""
    stiff = np.float32(STIFF)
    for c in range(len(going)):
        n = sums[0, c]
        mx, my, mz = sums[1, c] / n, sums[2, c] / n, sums[3, c] / n
        p, q, s = sums[4, c] / n - mx * mx + stiff, sums[5, c] / n - mx * my, sums[6, c] / n - my * my + stiff
        e, f = sums[7, c] / n - mx * mz + stiff * plane[1, c], sums[8, c] / n - my * mz + stiff * plane[2, c]
        det = p * s - q * q
        a, b = (e * s - f * q) / det, (f * p - e * q) / det
        h = mz - a * mx - b * my
        more = n > np.float32(0)
        plane[0, c] = h if more else plane[0, c]
        plane[1, c] = a if more else plane[1, c]
        plane[2, c] = b if more else plane[2, c]
