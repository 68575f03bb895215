"""Assigns points to the cells of a raster, in an order independent of the order of points and of tiling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit

Expected = tuple[Float32Array, Float32Array, Float32Array]
"""(N,) quality, trust and sigma of points, as in `CellPoints`."""


@dataclass(frozen=True, slots=True)
class CellPoints:
    """Points sorted by cell, and within a cell by height, then by place, then by what else tells them apart.

    Attributes
    ----------
    start : (rows · cols + 1,) points of cell i are start[i] to start[i + 1]
    u, v : (N,) float32, offset from the centre of the cell eastwards and southwards, cells
    z : (N,) float64, height, metres
    quality : (N,) float32, weight before nearness to a centre counts;  trust : (N,) float32, the same where precision does not count
    sigma : (N,) float32, expected standard deviation of the height, metres
    image : (N,) int64, number of the reference image;  origin : (N,) int64, row of the point in the cloud given
    """

    start: IntArray
    u: Float32Array
    v: Float32Array
    z: FloatArray
    quality: Float32Array
    trust: Float32Array
    sigma: Float32Array
    image: IntArray
    origin: IntArray


def cell_points(points: ImagePoints, grid: Grid, expected: Expected) -> CellPoints:
    """The points inside the grid by cell."""
    x_0, y_0 = _lattice(grid.x_min, grid.cell), _lattice(grid.y_max, grid.cell)
    cell, u, v = _places(points.xyz, (x_0[1], y_0[1]), (x_0[0], y_0[0]), grid.cell, grid.shape)
    start, order = _by_cell(cell, grid.rows * grid.cols)
    z = np.ascontiguousarray(points.xyz[:, 2])
    quality, trust, sigma = expected
    _sort_cells(start, order, z, u, v, quality, points.image)
    return CellPoints(
        start, u[order], v[order], z[order], quality[order], trust[order], sigma[order], points.image[order], order
    )


def _lattice(edge: float, cell: float) -> tuple[int, float]:
    """Number of the lattice line that an edge lies on, and by how much of a cell it misses it (0 on the lattice)."""
    number = round(edge / cell)
    rest = edge / cell - number
    return number, rest if abs(rest) > 1e-6 else 0.0


@njit(cache=True, nogil=True)
def _places(
    xyz: FloatArray, rest: tuple[float, float], first: tuple[int, int], cell_m: float, shape: tuple[int, int]
) -> tuple[NDArray[np.int32], Float32Array, Float32Array]:
    """Flat cell (-1 outside) and offsets from its centre; counted from the world's origin, so the same in every grid."""
    n = len(xyz)
    cell = np.empty(n, np.int32)
    u, v = np.empty(n, np.float32), np.empty(n, np.float32)
    for i in range(n):
        cell[i] = -1
        x, y = xyz[i, 0] / cell_m - rest[0], xyz[i, 1] / cell_m - rest[1]
        if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(xyz[i, 2])):
            continue
        col, line = np.floor(x), np.ceil(y)
        c, r = int(col) - first[0], first[1] - int(line)
        if r < 0 or c < 0 or r >= shape[0] or c >= shape[1]:
            continue
        cell[i] = r * shape[1] + c
        u[i], v[i] = x - col - 0.5, line - y - 0.5
    return cell, u, v


@njit(cache=True, nogil=True)
def _by_cell(cell: NDArray[np.int32], cells: int) -> tuple[IntArray, IntArray]:
    start = np.zeros(cells + 1, np.int64)
    for i in range(len(cell)):
        if cell[i] >= 0:
            start[cell[i] + 1] += 1
    for i in range(cells):
        start[i + 1] += start[i]
    order = np.empty(start[cells], np.int64)
    at = start[:-1].copy()
    for i in range(len(cell)):
        if cell[i] >= 0:
            order[at[cell[i]]] = i
            at[cell[i]] += 1
    return start, order


@njit(cache=True, nogil=True)
def _sort_cells(
    start: IntArray, order: IntArray, z: FloatArray, u: Float32Array, v: Float32Array, q: Float32Array, image: IntArray
) -> None:
    """Shell sort in each cell: a wall's cell may hold hundreds of points."""
    for k in range(len(start) - 1):
        low, n = start[k], start[k + 1] - start[k]
        gap = 1
        while gap < n // 3:
            gap = 3 * gap + 1
        while gap > 0:
            for i in range(gap, n):
                p, j = order[low + i], i
                while j >= gap and _before(p, order[low + j - gap], z, u, v, q, image):
                    order[low + j] = order[low + j - gap]
                    j -= gap
                order[low + j] = p
            gap //= 3


@njit(cache=True, nogil=True, inline="always")
def _before(a: int, b: int, z: FloatArray, u: Float32Array, v: Float32Array, q: Float32Array, image: IntArray) -> bool:
    if z[a] != z[b]:
        return bool(z[a] < z[b])
    if u[a] != u[b]:
        return bool(u[a] < u[b])
    if v[a] != v[b]:
        return bool(v[a] < v[b])
    if q[a] != q[b]:
        return bool(q[a] < q[b])
    return bool(image[a] < image[b])


def expected_precision(points: ImagePoints, weighing: tuple[float, float]) -> Expected:
    """(N,) weight of each point, the same without its precision, and σ of its height in metres.

    `weighing` is the scale of σ (metres), and the number of agreeing partners that counts half.
    """
    return _precision(points.xyz, points.centres, points.image, points.views, points.sigma, weighing)


def steepness(points: ImagePoints) -> FloatArray:
    """(N,) cosine of the angle between each point's ray and the vertical of the frame."""
    ray = points.centres[points.image] - points.xyz
    return np.asarray(ray[:, 2] / np.maximum(np.linalg.norm(ray, axis=1), 1e-9))


@njit(cache=True, nogil=True)
def _precision(
    xyz: FloatArray,
    centres: FloatArray,
    image: IntArray,
    views: ByteArray,
    sigma: Float32Array,
    weighing: tuple[float, float],
) -> Expected:
    scale, half_views = weighing
    n = len(xyz)
    quality, trust, height_sigma = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.float32)
    for i in range(n):
        c = centres[image[i]]
        x, y, z = c[0] - xyz[i, 0], c[1] - xyz[i, 1], c[2] - xyz[i, 2]
        upright = max(z / np.sqrt(x * x + y * y + z * z + 1e-12), 0.05)
        along = sigma[i] if np.isfinite(sigma[i]) and sigma[i] > 0 else scale
        height_sigma[i] = along * upright
        share = views[i] / (views[i] + half_views)
        trust[i] = max(share, 0.05)
        quality[i] = trust[i] / (1 + (along / scale) ** 2)
    return quality, trust, height_sigma
