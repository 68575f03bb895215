"""Normals of upright surfaces: the upright plane through most of a point's neighbours, not the mean of all of them.

A plain principal component analysis rounds every corner off and turns a bay of a metre into a bow. Here the neighbours first vote for the
direction of an upright plane through the point; the plane is then adjusted to those near it, with weights that fall with their distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.kernels import njit
from cityflow.outlines.from_walls.wall_thinning import Columns, Int32Array, Neighbourhoods, Voxels

DIRECTIONS = 24
"""That neighbours vote for: 7.5 degrees apart."""
ITERATIONS = 3
"""Rounds of re-weighting; set by hand, as are those below."""
REACH = 3.0
"""Neighbours further from the plane than so many bands have no say."""
RIDGE_M2 = 1e-3
"""Keeps the adjustment solvable where neighbours stand in one column."""


@dataclass(frozen=True, slots=True)
class Normals:
    """Planes through points.

    Attributes
    ----------
    normal : (N, 3) float32 unit vectors, either way; NaN where there were too few neighbours
    scatter : (N,) float32, root mean square distance of the neighbours from the plane that follow it, metres
    share : (N,) float32, share of the neighbours within two bands of it
    offset : (N,) float32, distance of the point from its plane along the normal, metres
    """

    normal: Float32Array
    scatter: Float32Array
    share: Float32Array
    offset: Float32Array


def steep(voxels: Voxels, columns: Columns, reach: int, rise: int) -> BoolArray:
    """Voxels about which the 3 x 3 columns hold heights further than `rise` levels apart, within `reach` levels up and down.

    Roofs and ground are left out before anything expensive is done with them.
    """
    return _steep(
        voxels.row - columns.row_0, voxels.col - columns.col_0, voxels.level, columns.start, columns.cols, reach, rise
    )


def normals(voxels: Voxels, columns: Columns, radius: float, band: float, least: int) -> Normals:
    """Planes through the voxels of a square of 2 x `radius` and as high.

    Parameters
    ----------
    voxels, columns : the same voxels, sorted, and where their columns begin (with a rim of ``radius / cell + 1`` empty ones)
    radius : metres
    band : distance at which a neighbour's weight has fallen to 0.6, metres: how thick walls are in the cloud
    least : fewest neighbours
    """
    n = len(voxels)
    out = np.full((n, 6), np.nan, np.float32)
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    votes = np.column_stack([np.cos(angles), np.sin(angles)])
    _planes(Neighbourhoods.of(voxels, columns, radius), band, least, votes, out)
    return Normals(out[:, :3], out[:, 3], out[:, 4], out[:, 5])


@njit(cache=True, nogil=True)
def _steep(
    row: Int32Array, col: Int32Array, level: Int32Array, start: Int32Array, cols: int, reach: int, rise: int
) -> BoolArray:
    found = np.zeros(len(level), np.bool_)
    for v in range(len(level)):
        low, high = level[v], level[v]
        for r in range(row[v] - 1, row[v] + 2):
            for c in range(col[v] - 1, col[v] + 2):
                place = r * cols + c
                for j in range(start[place], start[place + 1]):
                    if abs(level[j] - level[v]) <= reach:
                        low, high = min(low, level[j]), max(high, level[j])
        found[v] = high - low >= rise
    return found


@njit(cache=True, nogil=True)
def _planes(around: Neighbourhoods, band: float, least: int, votes: FloatArray, out: Float32Array) -> None:
    xyz, row, col, start, cols, reach, radius = around
    largest = 0
    for place in range(len(start) - 1):
        largest = max(largest, start[place + 1] - start[place])
    near = np.empty(((2 * reach + 1) ** 2 * largest, 3))
    column = np.empty(((2 * reach + 1) ** 2, 3))
    for v in range(len(xyz)):
        count, held = 0, 0
        for r in range(row[v] - reach, row[v] + reach + 1):
            for c in range(col[v] - reach, col[v] + reach + 1):
                begin = count
                x, y = 0.0, 0.0
                for j in range(start[r * cols + c], start[r * cols + c + 1]):
                    dx, dy, dz = xyz[j, 0] - xyz[v, 0], xyz[j, 1] - xyz[v, 1], xyz[j, 2] - xyz[v, 2]
                    if abs(dz) <= radius and dx * dx + dy * dy <= radius * radius:
                        near[count, 0], near[count, 1], near[count, 2] = dx, dy, dz
                        x += dx
                        y += dy
                        count += 1
                if count > begin:
                    column[held, 0], column[held, 1], column[held, 2] = (
                        x / (count - begin),
                        y / (count - begin),
                        count - begin,
                    )
                    held += 1
        if count < least:
            continue
        nx, ny = _voted(column[:held], votes, band)
        _adjusted(near[:count], nx, ny, band, out[v])


@njit(cache=True, nogil=True)
def _voted(column: FloatArray, votes: FloatArray, band: float) -> tuple[float, float]:
    """The direction whose upright plane through the origin has most neighbours near it."""
    best, found = -1.0, 0
    reach = 4.0 * band * band
    for k in range(len(votes)):
        total = 0.0
        for j in range(len(column)):
            d = votes[k, 0] * column[j, 0] + votes[k, 1] * column[j, 1]
            total += column[j, 2] * max(0.0, 1.0 - d * d / reach)
        if total > best:
            best, found = total, k
    return votes[found, 0], votes[found, 1]


@njit(cache=True, nogil=True)
def _adjusted(near: FloatArray, nx: float, ny: float, band: float, out: Float32Array) -> None:
    """Planes ``across = a + b · along + c · up`` by weighted least squares; the weights of each come from the one before.

    The axes are those of the direction voted for, so across is the only coordinate in error. Tukey's weights: 0 beyond `REACH` bands.
    """
    a, b, c = 0.0, 0.0, 0.0
    least = 1.0 / (REACH * band) ** 2
    for _ in range(ITERATIONS):
        w, wu, wz, wv, wuu, wuz, wzz, wuv, wzv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(len(near)):
            u, v, z = near[j, 1] * nx - near[j, 0] * ny, near[j, 0] * nx + near[j, 1] * ny, near[j, 2]
            d = v - a - b * u - c * z
            part = max(0.0, 1.0 - d * d * least) ** 2
            w, wu, wz, wv = w + part, wu + part * u, wz + part * z, wv + part * v
            wuu, wuz, wzz = wuu + part * u * u, wuz + part * u * z, wzz + part * z * z
            wuv, wzv = wuv + part * u * v, wzv + part * z * v
        if w < 1e-9:
            return
        mu, mz, mv = wu / w, wz / w, wv / w
        # a thread of points fixes no plane: the ridge keeps it upright and as voted for
        suu, szz, suz = wuu / w - mu * mu + RIDGE_M2, wzz / w - mz * mz + RIDGE_M2, wuz / w - mu * mz
        suv, szv = wuv / w - mu * mv, wzv / w - mz * mv
        det = suu * szz - suz * suz
        b, c = (suv * szz - szv * suz) / det, (szv * suu - suv * suz) / det
        a = mv - b * mu - c * mz
    length = np.sqrt(1.0 + b * b + c * c)
    total, square = 0.0, 0.0
    for j in range(len(near)):
        u, v, z = near[j, 1] * nx - near[j, 0] * ny, near[j, 0] * nx + near[j, 1] * ny, near[j, 2]
        d = (v - a - b * u - c * z) / length
        if abs(d) <= 2.0 * band:
            total += 1.0
            square += d * d
    out[0], out[1], out[2] = (nx + b * ny) / length, (ny - b * nx) / length, -c / length
    out[3] = np.sqrt(square / max(total, 1.0))
    out[4] = total / len(near)
    out[5] = -a / length
