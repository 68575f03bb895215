"""Planes fitted to the strips of cells along lines, by least absolute deviations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.kernels import njit

LEFT, RIGHT, ACROSS = 0, 1, 2
STATIONS = 24
"""Places along a line at which heights are looked up; more do not make it surer."""
ROWS = 5
ROUNDS = 4
BINS = 12
"""Of a line, in which heights are summed up to see whether they jump."""
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


class Jumps(NamedTuple):
    """Where heights jump along a line, by side (N, 2): share of the way, height of the jump and its standard deviation, metres."""

    share: FloatArray
    height: FloatArray
    sigma: FloatArray


class _Samples(NamedTuple):
    """Heights beside a line: share of the way from its middle, cells to the side, metres."""

    t: FloatArray
    u: FloatArray
    z: FloatArray


class _Fit(NamedTuple):
    start: float
    end: float
    scatter: float
    slope: float
    independent: float
    width: float


@njit(cache=True, nogil=True)
def strips(dsm: Float32Array, ends: FloatArray, cell: float, fully: bool) -> Strips:
    """Of the left side, the right side, and both as one plane.

    Parameters
    ----------
    dsm : (rows, cols) float32, metres
    ends : (N, 2, 2) column and row of start and end, counted from the centre of the first cell
    fully : if False, only the sides, and those only near the line
    """
    shape = (len(ends), 3)
    result = Strips(
        np.full((len(ends), 3, 2), np.nan), np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    )  # fmt: skip
    room = _room()
    for i in range(len(ends)):
        length = np.hypot(ends[i, 1, 0] - ends[i, 0, 0], ends[i, 1, 1] - ends[i, 0, 1])
        if length < 1e-6:
            continue
        for side in range(3 if fully else 2):
            fit = _strip(dsm, ends[i], (length, OUTER_CELLS, cell), side, room)
            if fully and fit.scatter > NOISY_CELLS * cell:
                wide = _strip(dsm, ends[i], (length, WIDE_CELLS, cell), side, room)
                fit = wide if wide.scatter <= STILL_FLAT * fit.scatter else fit
            result.z[i, side, 0], result.z[i, side, 1] = fit.start, fit.end
            result.scatter[i, side], result.slope[i, side] = fit.scatter, fit.slope
            result.independent[i, side], result.width[i, side] = fit.independent, fit.width
    return result


@njit(cache=True, nogil=True)
def jumps(dsm: Float32Array, ends: FloatArray, cell: float, least_cells: float) -> Jumps:
    """Where each side's heights jump along the line.

    The jump is 0 for lines shorter than twice `least_cells`.
    """
    shape = (len(ends), 2)
    result = Jumps(np.zeros(shape), np.zeros(shape), np.zeros(shape))
    room = _room()
    for i in range(len(ends)):
        length = np.hypot(ends[i, 1, 0] - ends[i, 0, 0], ends[i, 1, 1] - ends[i, 0, 1])
        if length < 2 * least_cells:
            continue
        for side in range(2):
            count = _gather(dsm, ends[i], (length, OUTER_CELLS), STATIONS, 1.0 - 2.0 * side, room, 0)
            if count < LEAST_KNOWN * STATIONS * ROWS:
                continue
            near = _first(room, count)
            start, end, _, slope = _fit(near, cell)
            rest = near.z - start - (end - start) * (near.t + 0.5) - slope * cell * near.u
            found = _jump(near.t, rest, least_cells / length)
            result.share[i, side], result.height[i, side], result.sigma[i, side] = found
    return result


@njit(cache=True, nogil=True)
def _room() -> _Samples:
    most = STATIONS * ROWS * 2
    return _Samples(np.empty(most), np.empty(most), np.empty(most))


@njit(cache=True, nogil=True)
def _first(samples: _Samples, count: int) -> _Samples:
    return _Samples(samples.t[:count], samples.u[:count], samples.z[:count])


@njit(cache=True, nogil=True)
def _jump(t: FloatArray, rest: FloatArray, margin: float) -> tuple[float, float, float]:
    """Share, height and standard deviation of the step that explains most of what a straight course leaves, in medians of bins along the line."""
    x, y, bins = np.empty(BINS), np.empty(BINS), 0
    first = 0
    for k in range(BINS):
        last = first
        while last < len(t) and t[last] < (k + 1) / BINS - 0.5:
            last += 1
        if last - first >= 3:
            x[bins], y[bins] = (k + 0.5) / BINS, np.median(rest[first:last])
            bins += 1
        first = last
    if bins < 6:
        return 0.0, 0.0, 0.0
    x, y = x[:bins], y[:bins]
    x0 = x.mean()
    spread = ((x - x0) ** 2).sum()
    straight = y - y.mean() - ((x - x0) * y).sum() / spread * (x - x0)
    gain, found = 0.0, (0.0, 0.0, 0.0)
    for k in range(1, bins):
        at = 0.5 * (x[k - 1] + x[k])
        if at < margin or at > 1 - margin:
            continue
        step = np.zeros(bins)
        step[k:] = 1.0
        step -= step.mean() + ((x - x0) * step).sum() / spread * (x - x0)
        size = (step * straight).sum() / (step * step).sum()
        if size * (step * straight).sum() > gain:
            gain = size * (step * straight).sum()
            found = at, size, 2.5 * np.abs(straight - size * step).mean()
    return found


@njit(cache=True, nogil=True)
def _strip(
    dsm: Float32Array, ends: FloatArray, size: tuple[float, float, float], side: int, room: _Samples
) -> _Fit:  # fmt: skip
    length, outer, cell = size
    stations = min(max(int(length), 4), STATIONS)
    first, last = (1.0, 1.0) if side == LEFT else ((-1.0, -1.0) if side == RIGHT else (-1.0, 1.0))
    count, asked, sign = 0, 0, first
    while True:
        count = _gather(dsm, ends, (length, outer), stations, sign, room, count)
        asked += stations * ROWS
        if sign >= last:
            break
        sign = last
    if count < LEAST_KNOWN * asked:
        return _Fit(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan)
    start, end, scatter, slope = _fit(_first(room, count), cell)
    width = (outer - INNER_CELLS) * (2.0 if side == ACROSS else 1.0)
    return _Fit(start, end, scatter, slope, max(count / asked * length * width / ALIKE_CELLS**2, 1.0), width * cell)


@njit(cache=True, nogil=True)
def _gather(
    dsm: Float32Array, ends: FloatArray, size: tuple[float, float], stations: int, sign: float,
    room: _Samples, count: int,
) -> int:  # fmt: skip
    """Known heights on one side: share of the way, cells across and metres, of the centres of the cells met."""
    length, outer = size
    rows, cols = dsm.shape
    along_x, along_y = (ends[1, 0] - ends[0, 0]) / length, (ends[1, 1] - ends[0, 1]) / length
    for k in range(stations):
        s = length * (k + 0.5) / stations
        for j in range(ROWS):
            w = sign * (INNER_CELLS + (outer - INNER_CELLS) * (j + 0.5) / ROWS)
            col = int(np.floor(ends[0, 0] + s * along_x - w * along_y + 0.5))
            row = int(np.floor(ends[0, 1] + s * along_y + w * along_x + 0.5))
            if row < 0 or col < 0 or row >= rows or col >= cols or not np.isfinite(dsm[row, col]):
                continue
            x, y = col - ends[0, 0], row - ends[0, 1]
            room.t[count] = (x * along_x + y * along_y) / length - 0.5
            room.u[count] = y * along_x - x * along_y
            room.z[count] = dsm[row, col]
            count += 1
    return count


@njit(cache=True, nogil=True)
def _fit(samples: _Samples, cell: float) -> tuple[float, float, float, float]:
    """Height at start and end, scatter and slope of a plane by least absolute deviations: reweighted least squares from the median."""
    t, u, z = samples
    n = len(t)
    rest = np.empty(n)
    middle = np.median(z)
    a, b, c = 0.0, 0.0, 0.0
    for turn in range(ROUNDS):
        w0, wt, wu, wtt, wtu, wuu, wz, wtz, wuz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            zi = z[i] - middle
            w = 1.0 if turn == 0 else 1.0 / max(abs(zi - a - b * t[i] - c * u[i]), 0.1 * cell)
            w0 += w
            wt += w * t[i]
            wu += w * u[i]
            wtt += w * t[i] * t[i]
            wtu += w * t[i] * u[i]
            wuu += w * u[i] * u[i]
            wz += w * zi
            wtz += w * t[i] * zi
            wuz += w * u[i] * zi
        w0 *= 1.0 + 1e-9
        wtt += 1e-9 * w0
        wuu += 1e-9 * w0
        # Cramer's rule: a call of a solver costs more than the sums
        p, q, r = wtt * wuu - wtu * wtu, wtu * wu - wt * wuu, wt * wtu - wtt * wu
        det = w0 * p + wt * q + wu * r
        a = (wz * p + wtz * q + wuz * r) / det
        b = (wz * q + wtz * (w0 * wuu - wu * wu) + wuz * (wt * wu - w0 * wtu)) / det
        c = (wz * r + wtz * (wt * wu - w0 * wtu) + wuz * (w0 * wtt - wt * wt)) / det
    for i in range(n):
        rest[i] = abs(z[i] - middle - a - b * t[i] - c * u[i])
    return middle + a - 0.5 * b, middle + a + 0.5 * b, 1.4826 * np.median(rest), c / cell
