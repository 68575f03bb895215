"""Normals of upright surfaces: the upright plane through most of a point's neighbours, not the mean of all of them.

A plain principal component analysis rounds every corner off and turns a bay of a metre into a bow. Here the neighbours first vote for the
direction of an upright plane through the point; the plane is then adjusted to those near it, with weights that fall with their distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
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
X, Y, Z, SCATTER, SHARE, OFFSET = range(6)
"""Columns of what is found: the normal, and what `Normals` has of it; coordinates of points have the first three."""
FOUND = 6
POINTS = 2
"""Column of the means of voxels over each other: number of points, after x and y."""


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
    out = np.full((n, FOUND), np.nan, np.float32)
    angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
    votes = np.stack([np.cos(angles), np.sin(angles)])
    _planes(Neighbourhoods.of(voxels, columns, radius), band, least, votes, out)
    return Normals(out[:, :SCATTER], out[:, SCATTER], out[:, SHARE], out[:, OFFSET])


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
def first_near(v: int, around: Neighbourhoods, low: IntArray) -> None:
    """Put into `low` where in each column around a voxel those begin that are not too far beneath; voxels are asked for in their order.

    Voxels of a column rise, so nothing beneath is looked at again for the next one of the same column.
    """
    xyz, row, col, start, cols, reach, radius = around
    k, is_new = 0, v == 0 or row[v] != row[v - 1] or col[v] != col[v - 1]
    for r in range(row[v] - reach, row[v] + reach + 1):
        for c in range(col[v] - reach, col[v] + reach + 1):
            j, end = start[r * cols + c] if is_new else low[k], start[r * cols + c + 1]
            while j < end and xyz[j, Z] - xyz[v, Z] < -radius:
                j += 1
            low[k] = j
            k += 1


@njit(cache=True, nogil=True)
def _planes(around: Neighbourhoods, band: float, least: int, votes: FloatArray, out: Float32Array) -> None:
    xyz, row, col, start, cols, reach, radius = around
    largest, square = 0, (2 * reach + 1) ** 2
    for place in range(len(start) - 1):
        largest = max(largest, start[place + 1] - start[place])
    near_x, near_y, near_z = np.empty(square * largest), np.empty(square * largest), np.empty(square * largest)
    column, low = np.empty((square, 3)), np.empty(square, np.int64)
    totals = np.empty(votes.shape[1])
    for v in range(len(xyz)):
        first_near(v, around, low)
        count, held, k = 0, 0, 0
        for r in range(row[v] - reach, row[v] + reach + 1):
            for c in range(col[v] - reach, col[v] + reach + 1):
                begin = count
                x, y = 0.0, 0.0
                for j in range(low[k], start[r * cols + c + 1]):
                    dx, dy, dz = xyz[j, X] - xyz[v, X], xyz[j, Y] - xyz[v, Y], xyz[j, Z] - xyz[v, Z]
                    if dz > radius:
                        break
                    if dx * dx + dy * dy <= radius * radius:
                        near_x[count], near_y[count], near_z[count] = dx, dy, dz
                        x += dx
                        y += dy
                        count += 1
                k += 1
                if count > begin:
                    column[held, X], column[held, Y], column[held, POINTS] = (
                        x / (count - begin),
                        y / (count - begin),
                        count - begin,
                    )
                    held += 1
        if count < least:
            continue
        nx, ny = _voted(column[:held], votes, band, totals)
        _turned(near_x[:count], near_y[:count], nx, ny)
        _adjusted(near_x[:count], near_y[:count], near_z[:count], nx, ny, band, out[v])


@njit(cache=True, nogil=True)
def _voted(column: FloatArray, votes: FloatArray, band: float, totals: FloatArray) -> tuple[float, float]:
    """The direction whose upright plane through the origin has most neighbours near it; all directions at once, so that they become vectors."""
    towards_x, towards_y = votes[X], votes[Y]
    reach = 4.0 * band * band
    totals[:] = 0.0
    for j in range(len(column)):
        x, y, points = column[j, X], column[j, Y], column[j, POINTS]
        for k in range(DIRECTIONS):
            d = towards_x[k] * x + towards_y[k] * y
            totals[k] += points * max(0.0, 1.0 - d * d / reach)
    found = np.argmax(totals)
    return towards_x[found], towards_y[found]


@njit(cache=True, nogil=True)
def _turned(x: FloatArray, y: FloatArray, nx: float, ny: float) -> None:
    """Put distances along and across the direction (nx, ny) of a normal in the place of x and y."""
    for j in range(len(x)):
        x[j], y[j] = y[j] * nx - x[j] * ny, x[j] * nx + y[j] * ny


@njit(cache=True, nogil=True)
def _adjusted(
    along: FloatArray, across: FloatArray, up: FloatArray, nx: float, ny: float, band: float, out: Float32Array
) -> None:
    """Planes ``across = a + b · along + c · up`` by weighted least squares; the weights of each come from the one before.

    The axes are those of the direction voted for, so across is the only coordinate in error. Tukey's weights: 0 beyond `REACH` bands.
    """
    a, b, c = 0.0, 0.0, 0.0
    least = 1.0 / (REACH * band) ** 2
    for _ in range(ITERATIONS):
        w, wu, wz, wv, wuu, wuz, wzz, wuv, wzv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(len(along)):
            u, v, z = along[j], across[j], up[j]
            d = v - a - b * u - c * z
            part = 1.0 - d * d * least
            part = part * part if part > 0.0 else 0.0
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
    for j in range(len(along)):
        d = (across[j] - a - b * along[j] - c * up[j]) / length
        near = abs(d) <= 2.0 * band
        total += 1.0 if near else 0.0
        square += d * d if near else 0.0
    out[X], out[Y], out[Z] = (nx + b * ny) / length, (ny - b * nx) / length, -c / length
    out[SCATTER] = np.sqrt(square / max(total, 1.0))
    out[SHARE] = total / len(along)
    out[OFFSET] = -a / length
