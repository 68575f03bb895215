"""Ground points to a terrain raster: local planes where there are points, a triangulation across the gaps."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit

N, X, Y, Z, XX, XY, YY, XZ, YZ = range(9)
"""Columns of the sums of a cell: number of points, their coordinates, products of these."""
SUMS = 9
MOVED_CELLS = 0.005
"""Positions are moved so far along rows and columns, at most."""


def terrain_from_points(xyz: FloatArray, grid: Grid) -> FloatArray:
    """(rows, cols) terrain height at cell centres from ground points (N, 3).

    Where the 3 x 3 cells around a centre hold enough points a plane is fitted to them; the other cells are bridged
    by linear interpolation between the cells around them, and beyond the hull take the nearest value. NaN only where
    there is no point at all.
    """
    return bridge_gaps(plane_heights(xyz, grid), grid)


def plane_heights(xyz: FloatArray, grid: Grid, half: int = 1) -> FloatArray:
    """(rows, cols) height at cell centres of the least-squares plane of the points in (2·half + 1)² cells, or NaN."""
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    row, col, xyz = row[inside], col[inside], xyz[inside]
    if len(xyz) == 0:
        return np.full(grid.shape, np.nan)
    z_0 = float(np.median(xyz[:, 2]))
    x = (xyz[:, 0] - grid.x_min) / grid.cell - col - 0.5
    y = (grid.y_max - xyz[:, 1]) / grid.cell - row - 0.5
    sums = _moments(row * grid.cols + col, x, y, xyz[:, 2] - z_0, grid.rows * grid.cols)
    return _fit_planes(sums.reshape(*grid.shape, 9), half) + z_0


@njit(cache=True, nogil=True)
def _moments(cell: IntArray, x: FloatArray, y: FloatArray, z: FloatArray, size: int) -> FloatArray:
    """(size, 9) sums of each cell, with x, y from its own centre in cells."""
    sums = np.zeros((size, SUMS))
    for i in range(len(cell)):
        s = sums[cell[i]]
        s[N] += 1
        s[X] += x[i]
        s[Y] += y[i]
        s[Z] += z[i]
        s[XX] += x[i] * x[i]
        s[XY] += x[i] * y[i]
        s[YY] += y[i] * y[i]
        s[XZ] += x[i] * z[i]
        s[YZ] += y[i] * z[i]
    return sums


@njit(cache=True, nogil=True)
def _fit_planes(sums: FloatArray, half: int) -> FloatArray:
    rows, cols = sums.shape[0], sums.shape[1]
    out = np.full((rows, cols), np.nan)
    t = np.empty(SUMS)
    for r in range(rows):
        for c in range(cols):
            t[:] = 0
            for i in range(max(r - half, 0), min(r + half + 1, rows)):
                for j in range(max(c - half, 0), min(c + half + 1, cols)):
                    s, d_x, d_y = sums[i, j], j - c, i - r
                    if s[N] == 0:
                        continue
                    t[N] += s[N]
                    t[X] += s[X] + d_x * s[N]
                    t[Y] += s[Y] + d_y * s[N]
                    t[Z] += s[Z]
                    t[XX] += s[XX] + 2 * d_x * s[X] + d_x * d_x * s[N]
                    t[XY] += s[XY] + d_x * s[Y] + d_y * s[X] + d_x * d_y * s[N]
                    t[YY] += s[YY] + 2 * d_y * s[Y] + d_y * d_y * s[N]
                    t[XZ] += s[XZ] + d_x * s[Z]
                    t[YZ] += s[YZ] + d_y * s[Z]
            out[r, c] = _height_at_centre(t)
    return out


@njit(cache=True, nogil=True)
def _height_at_centre(t: FloatArray) -> float:
    n = t[N]
    if n < 1:
        return np.nan
    m_x, m_y, m_z = t[X] / n, t[Y] / n, t[Z] / n
    if n < 4:
        return m_z if m_x * m_x + m_y * m_y < 0.12 else np.nan
    a, b, d = t[XX] / n - m_x * m_x, t[XY] / n - m_x * m_y, t[YY] / n - m_y * m_y
    e, f = t[XZ] / n - m_x * m_z, t[YZ] / n - m_y * m_z
    det = a * d - b * b
    if m_x * m_x + m_y * m_y > 1.2:
        return np.nan
    if det < 0.02:
        return m_z if m_x * m_x + m_y * m_y < 0.12 else np.nan
    g_x, g_y = (e * d - f * b) / det, (f * a - e * b) / det
    return m_z - g_x * m_x - g_y * m_y


def bridge_gaps(values: FloatArray, grid: Grid) -> FloatArray:
    """Fill NaN cells by the triangulation of the cells around them; beyond the hull by the nearest value."""
    from scipy.interpolate import LinearNDInterpolator  # takes long to load

    known = ~np.isnan(values)
    if known.all() or not known.any():
        return values
    edge = known & binary_dilation(~known, np.ones((3, 3), bool))
    edge |= _corner_cells(known)
    row, col = np.nonzero(edge)
    gap_row, gap_col = np.nonzero(~known)
    at, wanted = _unique_positions(row, col, grid), np.column_stack([gap_row, gap_col]).astype(float)
    heights = values[edge]
    filled = values.copy()
    found = np.full(len(wanted), np.nan)
    if len(at) >= 4 and np.ptp(row) > 0 and np.ptp(col) > 0:
        found = LinearNDInterpolator(at, heights)(wanted)
    missing = np.isnan(found)
    if missing.any():
        number = np.full(known.shape, -1, np.int64)
        number[edge] = np.arange(len(at))
        away = distance_transform_edt(~edge)
        found[missing] = heights[_nearest(number, away, at, gap_row[missing], gap_col[missing])]
    filled[~known] = found
    return filled


def mirrored_beyond(values: FloatArray, known: BoolArray, inside: BoolArray, most_cells: float) -> FloatArray:
    """(rows, cols) `values` with those outside a survey replaced by what lies as far within, mirrored at the nearest known cell.

    So a house at the survey's end has ground on both sides, as if the survey went on, and not a roof without end.

    Parameters
    ----------
    values, known : (rows, cols) metres, and which are measured
    inside : (rows, cols) the survey
    most_cells : farther outside values stay as they are
    """
    if inside.all() or not (known & inside).any():
        return values
    away, (row, col) = distance_transform_edt(~(known & inside), return_indices=True)
    rows, cols = np.indices(values.shape)
    row, col = 2 * row - rows, 2 * col - cols
    within = (row >= 0) & (col >= 0) & (row < values.shape[0]) & (col < values.shape[1])
    row, col = np.where(within, row, 0), np.where(within, col, 0)
    moved = ~inside & (away <= most_cells) & within & inside[row, col]
    return np.where(moved, values[row, col], values)


@njit(cache=True, nogil=True)
def _nearest(number: IntArray, away: FloatArray, at: FloatArray, row: IntArray, col: IntArray) -> IntArray:
    """Number of the position (N, 2) nearest to each cell.

    `number` (rows, cols) is that of the cell that a position was moved from, or -1; `away` (rows, cols) the distance from each cell to the nearest of these
    cells. So only a few cells are asked: those that are as far away, give or take how far positions were moved (twice √2 by `MOVED_CELLS`).
    """
    rows, cols = number.shape
    found, widest = np.empty(len(row), np.int64), 0.0
    for k in range(len(row)):
        widest = max(widest, away[row[k], col[k]])
    start, down, right = _by_distance(int(widest) + 2)
    for k in range(len(row)):
        r, c = row[k], col[k]
        nearest, farthest = int(np.round(away[r, c] ** 2)), int((away[r, c] + 3 * MOVED_CELLS) ** 2)
        best, least = -1, np.inf
        for m in range(start[nearest], start[farthest + 1]):
            for i in (r - down[m], r + down[m]):
                for j in (c - right[m], c + right[m]):
                    if 0 <= i < rows and 0 <= j < cols and number[i, j] >= 0:
                        y, x = r - at[number[i, j], 0], c - at[number[i, j], 1]
                        if y * y + x * x < least:
                            best, least = number[i, j], y * y + x * x
        found[k] = best
    return found


@njit(cache=True, nogil=True)
def _by_distance(reach: int) -> tuple[IntArray, IntArray, IntArray]:
    """Steps down and to the right, none longer than `reach` together, sorted by their squared length; and where those of each length begin."""
    most = reach * reach
    start = np.zeros(most + 2, np.int64)
    for i in range(reach + 1):
        for j in range(reach + 1):
            if i * i + j * j <= most:
                start[i * i + j * j + 1] += 1
    for k in range(most + 1):
        start[k + 1] += start[k]
    at, down, right = start.copy(), np.empty(start[most + 1], np.int64), np.empty(start[most + 1], np.int64)
    for i in range(reach + 1):
        for j in range(reach + 1):
            if i * i + j * j <= most:
                k = at[i * i + j * j]
                down[k], right[k] = i, j
                at[i * i + j * j] += 1
    return start, down, right


def _corner_cells(known: BoolArray) -> BoolArray:
    """The known cells nearest to the four corners of the raster, so that the hull is as wide as it can be."""
    row, col = np.nonzero(known)
    chosen = np.zeros_like(known)
    for sign_r, sign_c in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        best = int(np.argmin(sign_r * row + sign_c * col))
        chosen[row[best], col[best]] = True
    return chosen


def _unique_positions(row: IntArray, col: IntArray, grid: Grid) -> FloatArray:
    """(n, 2) cell positions moved by up to `MOVED_CELLS`, by a rule of the cell's place in the world alone.

    Lattice points lie on common circles, where the triangulation is free to choose; the shift makes it unique, and
    so the same in every tiling.
    """
    world_row = (row - round(grid.y_max / grid.cell)).astype(np.uint64)
    world_col = (col + round(grid.x_min / grid.cell)).astype(np.uint64)
    mixed = world_row * np.uint64(0x9E3779B97F4A7C15) ^ world_col * np.uint64(0xC2B2AE3D27D4EB4F)
    mixed ^= mixed >> np.uint64(29)
    mixed *= np.uint64(0xBF58476D1CE4E5B9)
    low = (mixed >> np.uint64(16) & np.uint64(0xFFFF)).astype(float) / 0xFFFF
    high = (mixed >> np.uint64(40) & np.uint64(0xFFFF)).astype(float) / 0xFFFF
    return np.column_stack([row + 2 * MOVED_CELLS * (low - 0.5), col + 2 * MOVED_CELLS * (high - 0.5)])
