"""Ground points to a terrain raster: local planes where there are points, a triangulation across the gaps."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit


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
    """Per cell: n, x, y, z, xx, xy, yy, xz, yz summed, with x, y from the cell's own centre in cells."""
    sums = np.zeros((size, 9))
    for i in range(len(cell)):
        s = sums[cell[i]]
        s[0] += 1
        s[1] += x[i]
        s[2] += y[i]
        s[3] += z[i]
        s[4] += x[i] * x[i]
        s[5] += x[i] * y[i]
        s[6] += y[i] * y[i]
        s[7] += x[i] * z[i]
        s[8] += y[i] * z[i]
    return sums


@njit(cache=True, nogil=True)
def _fit_planes(sums: FloatArray, half: int) -> FloatArray:
    rows, cols = sums.shape[0], sums.shape[1]
    out = np.full((rows, cols), np.nan)
    t = np.empty(9)
    for r in range(rows):
        for c in range(cols):
            t[:] = 0
            for i in range(max(r - half, 0), min(r + half + 1, rows)):
                for j in range(max(c - half, 0), min(c + half + 1, cols)):
                    s, d_x, d_y = sums[i, j], j - c, i - r
                    if s[0] == 0:
                        continue
                    t[0] += s[0]
                    t[1] += s[1] + d_x * s[0]
                    t[2] += s[2] + d_y * s[0]
                    t[3] += s[3]
                    t[4] += s[4] + 2 * d_x * s[1] + d_x * d_x * s[0]
                    t[5] += s[5] + d_x * s[2] + d_y * s[1] + d_x * d_y * s[0]
                    t[6] += s[6] + 2 * d_y * s[2] + d_y * d_y * s[0]
                    t[7] += s[7] + d_x * s[3]
                    t[8] += s[8] + d_y * s[3]
            out[r, c] = _height_at_centre(t)
    return out


@njit(cache=True, nogil=True)
def _height_at_centre(t: FloatArray) -> float:
    n = t[0]
    if n < 1:
        return np.nan
    m_x, m_y, m_z = t[1] / n, t[2] / n, t[3] / n
    if n < 4:
        return m_z if m_x * m_x + m_y * m_y < 0.12 else np.nan
    a, b, d = t[4] / n - m_x * m_x, t[5] / n - m_x * m_y, t[6] / n - m_y * m_y
    e, f = t[7] / n - m_x * m_z, t[8] / n - m_y * m_z
    det = a * d - b * b
    if m_x * m_x + m_y * m_y > 1.2:
        return np.nan
    if det < 0.02:
        return m_z if m_x * m_x + m_y * m_y < 0.12 else np.nan
    g_x, g_y = (e * d - f * b) / det, (f * a - e * b) / det
    return m_z - g_x * m_x - g_y * m_y


def bridge_gaps(values: FloatArray, grid: Grid) -> FloatArray:
    """Fill NaN cells by the triangulation of the cells around them; beyond the hull by the nearest value."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator  # takes long to load

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
        found[missing] = NearestNDInterpolator(at, heights)(wanted[missing])
    filled[~known] = found
    return filled


def _corner_cells(known: BoolArray) -> BoolArray:
    """The known cells nearest to the four corners of the raster, so that the hull is as wide as it can be."""
    row, col = np.nonzero(known)
    chosen = np.zeros_like(known)
    for sign_r, sign_c in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        best = int(np.argmin(sign_r * row + sign_c * col))
        chosen[row[best], col[best]] = True
    return chosen


def _unique_positions(row: IntArray, col: IntArray, grid: Grid) -> FloatArray:
    """(n, 2) cell positions moved by up to 0.005 cells, by a rule of the cell's place in the world alone.

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
    return np.column_stack([row + 0.01 * (low - 0.5), col + 0.01 * (high - 0.5)])
