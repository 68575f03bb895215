"""Planes fitted to the strips of cells along lines, by least absolute deviations."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.kernels import njit

LEFT, RIGHT, ACROSS = 0, 1, 2
START, END, SCATTER, SLOPE, COUNT, WIDTH = range(6)
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


@njit(cache=True, nogil=True)
def strips(dsm: Float32Array, ends: FloatArray, cell: float, fully: bool) -> FloatArray:
    """(N, 3, 6) of the left side, the right side, and both as one plane.

    Parameters
    ----------
    dsm : (rows, cols) float32, metres
    ends : (N, 2, 2) column and row of start and end, counted from the centre of the first cell
    fully : if False, only the sides, and those only near the line

    Returns
    -------
    Height on the line at start and end, robust standard deviation about the plane (metres), slope across the line
    (metres per metre, to the right), number of independent heights, width of the strip (metres); NaN where less than
    half of a strip is known
    """
    result = np.full((len(ends), 3, 6), np.nan)
    t, u, z = np.empty(STATIONS * ROWS * 2), np.empty(STATIONS * ROWS * 2), np.empty(STATIONS * ROWS * 2)
    wide = np.empty(6)
    for i in range(len(ends)):
        length = np.hypot(ends[i, 1, 0] - ends[i, 0, 0], ends[i, 1, 1] - ends[i, 0, 1])
        if length < 1e-6:
            continue
        for side in range(3 if fully else 2):
            _strip(dsm, ends[i], (length, OUTER_CELLS, cell), side, (t, u, z), result[i, side])
            if fully and result[i, side, SCATTER] > NOISY_CELLS * cell:
                wide[:] = np.nan
                _strip(dsm, ends[i], (length, WIDE_CELLS, cell), side, (t, u, z), wide)
                if wide[SCATTER] <= STILL_FLAT * result[i, side, SCATTER]:
                    result[i, side] = wide
    return result


@njit(cache=True, nogil=True)
def jumps(dsm: Float32Array, ends: FloatArray, cell: float, least_cells: float) -> FloatArray:
    """(N, 2, 3) where each side's heights jump along the line: share of the way, height of the jump, its standard deviation.

    The jump is 0 for lines shorter than twice `least_cells`.
    """
    result = np.zeros((len(ends), 2, 3))
    t, u, z = np.empty(STATIONS * ROWS * 2), np.empty(STATIONS * ROWS * 2), np.empty(STATIONS * ROWS * 2)
    plane = np.empty(6)
    for i in range(len(ends)):
        length = np.hypot(ends[i, 1, 0] - ends[i, 0, 0], ends[i, 1, 1] - ends[i, 0, 1])
        if length < 2 * least_cells:
            continue
        for side in range(2):
            count = _gather(dsm, ends[i], (length, OUTER_CELLS), STATIONS, 1.0 - 2.0 * side, (t, u, z), 0)
            if count < LEAST_KNOWN * STATIONS * ROWS:
                continue
            _fit(t[:count], u[:count], z[:count], cell, plane)
            rest = (
                z[:count]
                - plane[START]
                - (plane[END] - plane[START]) * (t[:count] + 0.5)
                - plane[SLOPE] * cell * u[:count]
            )
            _jump(t[:count], rest, least_cells / length, result[i, side])
    return result


@njit(cache=True, nogil=True)
def _jump(t: FloatArray, rest: FloatArray, margin: float, result: FloatArray) -> None:
    """The step that explains most of what a straight course leaves, in medians of bins along the line."""
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
        return
    x, y = x[:bins], y[:bins]
    x0 = x.mean()
    spread = ((x - x0) ** 2).sum()
    straight = y - y.mean() - ((x - x0) * y).sum() / spread * (x - x0)
    gain = 0.0
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
            result[0], result[1], result[2] = at, size, 2.5 * np.abs(straight - size * step).mean()


@njit(cache=True, nogil=True)
def _strip(
    dsm: Float32Array, ends: FloatArray, size: tuple[float, float, float], side: int,
    samples: tuple[FloatArray, FloatArray, FloatArray], result: FloatArray,
) -> None:  # fmt: skip
    length, outer, cell = size
    t, u, z = samples
    stations = min(max(int(length), 4), STATIONS)
    first, last = (1.0, 1.0) if side == LEFT else ((-1.0, -1.0) if side == RIGHT else (-1.0, 1.0))
    count, asked, sign = 0, 0, first
    while True:
        count = _gather(dsm, ends, (length, outer), stations, sign, (t, u, z), count)
        asked += stations * ROWS
        if sign >= last:
            break
        sign = last
    if count < LEAST_KNOWN * asked:
        return
    _fit(t[:count], u[:count], z[:count], cell, result)
    width = (outer - INNER_CELLS) * (2.0 if side == ACROSS else 1.0)
    result[COUNT] = max(count / asked * length * width / ALIKE_CELLS**2, 1.0)
    result[WIDTH] = width * cell


@njit(cache=True, nogil=True)
def _gather(
    dsm: Float32Array, ends: FloatArray, size: tuple[float, float], stations: int, sign: float,
    samples: tuple[FloatArray, FloatArray, FloatArray], count: int,
) -> int:  # fmt: skip
    """Known heights on one side: share of the way, cells across and metres, of the centres of the cells met."""
    length, outer = size
    t, u, z = samples
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
            t[count] = (x * along_x + y * along_y) / length - 0.5
            u[count] = y * along_x - x * along_y
            z[count] = dsm[row, col]
            count += 1
    return count


@njit(cache=True, nogil=True)
def _fit(t: FloatArray, u: FloatArray, z: FloatArray, cell: float, result: FloatArray) -> None:
    """Plane by least absolute deviations: reweighted least squares from the median."""
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
    result[START], result[END] = middle + a - 0.5 * b, middle + a + 0.5 * b
    result[SCATTER] = 1.4826 * np.median(rest)
    result[SLOPE] = c / cell
