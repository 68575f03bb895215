"""Assigns points to the cells of a raster, in an order independent of the order of points and of tiling."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit

TOP_CELLS = 2
"""An image that sees a top has a point this near to it, cells: matching leaves gaps; set by hand."""


class CellPoints(NamedTuple):
    """Points sorted by cell, and within a cell by height, then by place, then by what else tells them apart.

    Attributes
    ----------
    shape : rows and columns
    start : (rows · cols + 1,) points of cell i are start[i] to start[i + 1]
    u, v : (N,) float32, offset from the centre of the cell eastwards and southwards, cells
    z : (N,) float64, height, metres
    quality : (N,) float32, weight before nearness to a centre counts;  trust : (N,) float32, the same where precision does not count
    sigma : (N,) float32, expected standard deviation of the height, metres
    image : (N,) int32, number of the reference image
    steep : (N,) whether its ray is nearer to the vertical than asked for
    """

    shape: tuple[int, int]
    start: IntArray
    u: Float32Array
    v: Float32Array
    z: FloatArray
    quality: Float32Array
    trust: Float32Array
    sigma: Float32Array
    image: NDArray[np.int32]
    steep: BoolArray

    @property
    def in_cells(self) -> NDArray[np.uint32]:
        """(rows, cols) points of each cell."""
        return np.diff(self.start).reshape(self.shape).astype(np.uint32)


class Weighing(NamedTuple):
    """How exact a point is, and whether it is seen from above.

    Attributes
    ----------
    scale_m : of the standard deviation along a ray, metres
    half_views : number of agreeing partners that counts half
    steep : cosine of the angle to the vertical from which a ray is steep
    """

    scale_m: float
    half_views: float
    steep: float


class _Cloud(NamedTuple):
    """Points, as in `ImagePoints`."""

    xyz: FloatArray
    centres: FloatArray
    image: IntArray
    views: ByteArray
    sigma: Float32Array


class _Lattice(NamedTuple):
    """By how much of a cell the left and the upper edge miss a line of the world's lattice; the numbers of these lines; metres; rows and columns."""

    rest: tuple[float, float]
    first: tuple[int, int]
    cell: float
    shape: tuple[int, int]


def cell_points(points: ImagePoints, grid: Grid, weighing: Weighing) -> CellPoints:
    """The points inside the grid by cell."""
    (left, x_rest), (top, y_rest) = _line(grid.x_min, grid.cell), _line(grid.y_max, grid.cell)
    lattice = _Lattice((x_rest, y_rest), (left, top), grid.cell, grid.shape)
    cloud = _Cloud(points.xyz, points.centres, points.image, points.views, points.sigma)
    start, order, z = _by_cell(points.xyz, lattice)
    _sort_cells(start, order, z, cloud, lattice, weighing)
    return CellPoints(grid.shape, start, *_described(order, z, cloud, lattice, weighing))


def chosen(points: CellPoints, which: BoolArray) -> CellPoints:
    """Those of the points that the mask (N,) names."""
    return CellPoints(points.shape, *_chosen(points, which))


def kept_in_place(points: CellPoints, which: BoolArray) -> CellPoints:
    """Those of the points that the mask (N,) names, in the memory of all: who calls has no use for the others any more."""
    start = _closed_up(points, which)
    n = int(start[-1])
    u, v, z, quality, trust, sigma, image, steep = points[2:]
    return CellPoints(points.shape, start, u[:n], v[:n], z[:n], quality[:n], trust[:n], sigma[:n], image[:n], steep[:n])


def not_below(points: CellPoints, limit: Float32Array, top: Float32Array, near: float) -> BoolArray:
    """(N,) which points are steep, or do not lie below the limit (rows, cols; metres) of their cell, or are of an image that does not see the top.

    What an image sees beneath a place, it sees past what stands there. Where that is real, a roof or a crown, the image sees its top, too: it has a point
    within `near` metres of the top (rows, cols; metres) of a cell at most `TOP_CELLS` away.
    """
    return np.asarray(_not_below(points.start, points.z, (points.steep, points.image), limit, top, near))


def _line(edge: float, cell: float) -> tuple[int, float]:
    """Number of the lattice line that an edge lies on, and by how much of a cell it misses it (0 on the lattice)."""
    number = round(edge / cell)
    rest = edge / cell - number
    return number, rest if abs(rest) > 1e-6 else 0.0


@njit(cache=True, nogil=True)
def _place(xyz: FloatArray, i: int, lattice: _Lattice) -> tuple[int, np.float32, np.float32]:
    """Flat cell of a point (-1 outside) and its offsets from the centre; counted from the world's origin, so the same in every grid."""
    none = np.float32(0.0)
    x, y = xyz[i, 0] / lattice.cell - lattice.rest[0], xyz[i, 1] / lattice.cell - lattice.rest[1]
    if not (np.isfinite(x) and np.isfinite(y) and np.isfinite(xyz[i, 2])):
        return -1, none, none
    col, line = np.floor(x), np.ceil(y)
    c, r = int(col) - lattice.first[0], lattice.first[1] - int(line)
    if r < 0 or c < 0 or r >= lattice.shape[0] or c >= lattice.shape[1]:
        return -1, none, none
    return r * lattice.shape[1] + c, np.float32(x - col - 0.5), np.float32(line - y - 0.5)


@njit(cache=True, nogil=True)
def _by_cell(xyz: FloatArray, lattice: _Lattice) -> tuple[IntArray, IntArray, FloatArray]:
    """Where each cell begins; rows and heights of its points."""
    cells = lattice.shape[0] * lattice.shape[1]
    cell, start = np.empty(len(xyz), np.int64), np.zeros(cells + 1, np.int64)
    for i in range(len(xyz)):
        cell[i] = _place(xyz, i, lattice)[0]
        if cell[i] >= 0:
            start[cell[i] + 1] += 1
    for k in range(cells):
        start[k + 1] += start[k]
    order, z, at = np.empty(start[cells], np.int64), np.empty(start[cells]), start[:-1].copy()
    for i in range(len(xyz)):
        if cell[i] >= 0:
            k = at[cell[i]]
            order[k], z[k] = i, xyz[i, 2]
            at[cell[i]] = k + 1
    return start, order, z


@njit(cache=True, nogil=True)
def _sort_cells(start, order, z, cloud, lattice, weighing):  # type: ignore[no-untyped-def]
    """Shell sort in each cell: a wall's cell may hold hundreds of points."""
    for k in range(len(start) - 1):
        low, n = start[k], start[k + 1] - start[k]
        gap = 1
        while gap < n // 3:
            gap = 3 * gap + 1
        while gap > 0:
            for i in range(low + gap, low + n):
                p, h, j = order[i], z[i], i
                while j >= low + gap and (
                    h < z[j - gap] or (h == z[j - gap] and _before(p, order[j - gap], cloud, lattice, weighing))
                ):
                    order[j], z[j] = order[j - gap], z[j - gap]
                    j -= gap
                order[j], z[j] = p, h
            gap //= 3


@njit(cache=True, nogil=True)
def _before(a, b, cloud, lattice, weighing):  # type: ignore[no-untyped-def]
    """Which of two points of the same cell and height comes first."""
    _, u_a, v_a = _place(cloud.xyz, a, lattice)
    _, u_b, v_b = _place(cloud.xyz, b, lattice)
    if u_a != u_b:
        return u_a < u_b
    if v_a != v_b:
        return v_a < v_b
    q_a, q_b = _precision(a, cloud, weighing)[0], _precision(b, cloud, weighing)[0]
    if q_a != q_b:
        return q_a < q_b
    return cloud.image[a] < cloud.image[b]


@njit(cache=True, nogil=True)
def _precision(i, cloud, weighing):  # type: ignore[no-untyped-def]
    """Weight of a point, the same without its precision, σ of its height in metres, and whether its ray is steep."""
    c = cloud.centres[cloud.image[i]]
    x, y, z = c[0] - cloud.xyz[i, 0], c[1] - cloud.xyz[i, 1], c[2] - cloud.xyz[i, 2]
    square = x * x + y * y + z * z
    upright = max(z / np.sqrt(square + 1e-12), 0.05)
    given = cloud.sigma[i]
    along = given if np.isfinite(given) and given > 0 else weighing.scale_m
    share = cloud.views[i] / (cloud.views[i] + weighing.half_views)
    trust = np.float32(max(share, 0.05))
    quality = np.float32(trust / (1 + (along / weighing.scale_m) ** 2))
    return quality, trust, np.float32(along * upright), z / max(np.sqrt(square), 1e-9) >= weighing.steep


@njit(cache=True, nogil=True)
def _described(order, z, cloud, lattice, weighing):  # type: ignore[no-untyped-def]
    """Columns of `CellPoints` for sorted rows of points."""
    u, v, _, quality, trust, sigma, image, steep = _columns(len(order))
    for k in range(len(order)):
        i = order[k]
        _, u[k], v[k] = _place(cloud.xyz, i, lattice)
        quality[k], trust[k], sigma[k], steep[k] = _precision(i, cloud, weighing)
        image[k] = cloud.image[i]
    return u, v, z, quality, trust, sigma, image, steep


@njit(cache=True, nogil=True)
def _chosen(points, which):  # type: ignore[no-untyped-def]
    start = np.zeros(len(points.start), np.int64)
    for k in range(len(start) - 1):
        start[k + 1] = start[k]
        for i in range(points.start[k], points.start[k + 1]):
            start[k + 1] += which[i]
    u, v, z, quality, trust, sigma, image, steep = _columns(start[-1])
    n = 0
    for i in range(len(which)):
        if which[i]:
            u[n], v[n], z[n], quality[n], trust[n] = (
                points.u[i],
                points.v[i],
                points.z[i],
                points.quality[i],
                points.trust[i],
            )
            sigma[n], image[n], steep[n] = points.sigma[i], points.image[i], points.steep[i]
            n += 1
    return start, u, v, z, quality, trust, sigma, image, steep


@njit(cache=True, nogil=True)
def _closed_up(points, which):  # type: ignore[no-untyped-def]
    """Move the points that the mask names to the front of their columns; returns where each cell begins now."""
    start, n = np.zeros(len(points.start), np.int64), 0
    for k in range(len(start) - 1):
        for i in range(points.start[k], points.start[k + 1]):
            if which[i]:
                points.u[n], points.v[n], points.z[n] = points.u[i], points.v[i], points.z[i]
                points.quality[n], points.trust[n] = points.quality[i], points.trust[i]
                points.sigma[n], points.image[n], points.steep[n] = points.sigma[i], points.image[i], points.steep[i]
                n += 1
        start[k + 1] = n
    return start


@njit(cache=True, nogil=True)
def _columns(n):  # type: ignore[no-untyped-def]
    """Room for the columns of `CellPoints` behind `start`."""
    kind = np.float32
    u, v, quality, trust, sigma = (
        np.empty(n, kind),
        np.empty(n, kind),
        np.empty(n, kind),
        np.empty(n, kind),
        np.empty(n, kind),
    )
    return u, v, np.empty(n), quality, trust, sigma, np.empty(n, np.int32), np.empty(n, np.bool_)


@njit(cache=True, nogil=True)
def _not_below(start, z, views, limit, top, near):  # type: ignore[no-untyped-def]
    steep, image = views
    rows, cols = top.shape
    kept = np.empty(len(z), np.bool_)
    for r in range(rows):
        for c in range(cols):
            k = r * cols + c
            last, sees = np.int64(-1), False
            for i in range(start[k], start[k + 1]):
                kept[i] = steep[i] or not z[i] < limit[r, c]
                if not kept[i]:
                    if image[i] != last:
                        last, sees = image[i], _sees_top(start, z, image, image[i], (r, c), top, near)
                    kept[i] = not sees
    return kept


@njit(cache=True, nogil=True)
def _sees_top(start, z, image, own, place, top, near):  # type: ignore[no-untyped-def]
    r, c = place
    rows, cols = top.shape
    for i in range(max(r - TOP_CELLS, 0), min(r + TOP_CELLS + 1, rows)):
        for j in range(max(c - TOP_CELLS, 0), min(c + TOP_CELLS + 1, cols)):
            for k in range(start[i * cols + j], start[i * cols + j + 1]):
                if image[k] == own and abs(z[k] - top[i, j]) <= near:
                    return True
    return False
