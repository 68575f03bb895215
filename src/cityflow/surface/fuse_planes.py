"""Smoothing of the fused surface: neighbouring cells of one surface share their points; across a step they do not."""

from __future__ import annotations

import cv2
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.kernels import njit
from cityflow.surface.fuse_modes import Modes

ROUNDS = 3
"""Of re-weighting a plane; set by hand."""
REACH = 2
"""Cells to each side that a plane is made of; `_add_first` and `_add_again` name them one by one."""
SIDE = 2 * REACH + 1
RUN, LANES = 64, 8
"""Cells of a row at a time, so that what belongs to them stays in the nearest cache; of these as many at once as the widest vectors have numbers."""
WIDE = RUN + 2 * REACH
FIELDS, EAST, SOUTH, SUPPORT = 4, WIDE, 2 * WIDE, 3 * WIDE
"""Of a row around a run: heights, then these."""
SUMS = 9
PLANE, A, B, H, OPEN = 4, 0, RUN, 2 * RUN, 3 * RUN
"""Of a run: slopes eastwards and southwards, metres a cell; height over the mode, metres; 1 until a round finds no weight."""


def on_planes(found: Modes, radius: float, band: float) -> FloatArray:
    """(rows, cols) height at each centre of the plane through the modes within `radius` (2 to 2.5 cells) that lie on one surface with it.

    `band` (metres) is how far a mode may lie off the plane; between rounds what lies further off weighs nothing. Tilt is allowed for: the first
    round takes what rises from the centre by no more than a band a cell.
    """
    z = np.full(found.z.shape, np.nan)
    _fit(found.z, found.u, found.v, found.support, radius, band, np.ones(z.shape, np.bool_), z)
    return z


def again_on_planes(z: FloatArray, found: Modes, changed: BoolArray, radius: float, band: float) -> FloatArray:
    """`on_planes` of modes that differ only where (rows, cols) `changed` says so from those that it made `z` of."""
    size = 2 * int(radius) + 1
    near = cv2.dilate(changed.astype(np.uint8), np.ones((size, size), np.uint8), borderValue=0)
    out = z.copy()
    _fit(found.z, found.u, found.v, found.support, radius, band, near.astype(np.bool_), out)
    return out


@intrinsic
def _root(_typing, _square):  # type: ignore[no-untyped-def]
    """The square root, as an instruction: numba's calls a function for negative numbers, which keeps a loop from becoming vectors."""

    def generate(_context, builder, _signature, args):  # type: ignore[no-untyped-def]
        number = ir.DoubleType()
        kind = ir.FunctionType(number, [number])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, "llvm.sqrt.f64"), args)

    return types.float64(types.float64), generate


@njit(cache=True, nogil=True)
def _fit(
    z: FloatArray, u: Float32Array, v: Float32Array, support: Float32Array, radius: float, band: float, asked: BoolArray, out: FloatArray
) -> None:  # fmt: skip
    """Run by run of a row, so that loops over cells become vector instructions; a cell's sums are those of its neighbours row by row."""
    around, near, limit = np.empty(SIDE * FIELDS * WIDE), np.empty(SIDE * SIDE * RUN), np.empty(SIDE * SIDE * RUN)
    sums, plane = np.empty(SUMS * RUN), np.empty(PLANE * RUN)
    widest = (radius + 0.5) * (radius + 0.5)
    for r in range(z.shape[0]):
        for first in range(0, z.shape[1], RUN):
            last = min(first + RUN, z.shape[1])
            for c in range(first, last):
                if asked[r, c]:
                    out[r, c] = np.nan
            low, high = _asked_part(asked[r], z[r], first, last)
            if low < high:
                _gather((r, low, high), z, u, v, support, around)
                # whole vectors: what stands beyond the run is empty
                many = (high - low + LANES - 1) // LANES * LANES
                _fit_run(around, (near, limit), sums, plane, many, (widest, band))
                for c in range(low, high):
                    if asked[r, c]:
                        out[r, c] = z[r, c] + plane[H + c - low]


@njit(cache=True, nogil=True)
def _asked_part(asked: BoolArray, z: FloatArray, low: int, high: int) -> tuple[int, int]:
    """The part of a row from the first cell with a mode that is asked to the last."""
    while low < high and (not asked[low] or np.isnan(z[low])):
        low += 1
    while low < high and (not asked[high - 1] or np.isnan(z[high - 1])):
        high -= 1
    return low, high


@njit(cache=True, nogil=True)
def _gather(
    run: tuple[int, int, int], z: FloatArray, u: Float32Array, v: Float32Array, support: Float32Array, around: FloatArray
) -> None:  # fmt: skip
    """The cells of a run (its row, first and end column) and around it into `around`; those without a mode, and beyond the raster, have no support."""
    row, low, high = run
    around[:] = 0.0
    left, right = max(low - REACH, 0), min(high + REACH, z.shape[1])
    for k in range(SIDE):
        i, at = row + k - REACH, k * FIELDS * WIDE + REACH - low
        if i < 0 or i >= z.shape[0]:
            continue
        for j in range(left, right):
            known = not np.isnan(z[i, j])
            around[at + j] = z[i, j] if known else 0.0
            around[at + j + SUPPORT] = support[i, j] if known else 0.0
            around[at + j + EAST] = u[i, j]
            around[at + j + SOUTH] = v[i, j]


@njit(cache=True, nogil=True)
def _fit_run(around, weights, sums, plane, count, limits):  # type: ignore[no-untyped-def]
    """Height and slopes of the plane over the mode of each cell into `plane`."""
    near, limit = weights
    centre = around[REACH * FIELDS * WIDE + REACH :]
    for k in range(SIDE):
        for m in range(SIDE):
            row, at = around[k * FIELDS * WIDE + m :], (k * SIDE + m) * RUN
            _weigh(row, (m - 2.0, k - 2.0), near[at:], limit[at:], count, limits)
    plane[:OPEN] = 0.0
    plane[OPEN:] = 1.0
    for rounds in range(ROUNDS):
        if rounds == 1:
            limit[:] = limits[1]
        sums[:] = 0.0
        for k in range(SIDE):
            row, at = around[k * FIELDS * WIDE :], k * SIDE * RUN
            _add_row((row, centre), k - 2.0, (near[at:], limit[at:]), sums, plane, count)
        _solve(sums, plane, count)


@njit(cache=True, nogil=True, error_model="numpy")
def _weigh(around, step, near, limit, count, limits):  # type: ignore[no-untyped-def]
    """How near a neighbour of each cell is, less and less from 1 at the centre to 0; and how far off it may lie in the first round, metres."""
    for c in range(count):
        x, y = step[0] + around[c + EAST], step[1] + around[c + SOUTH]
        apart = x * x + y * y
        far, away = apart / limits[0], _root(apart)
        near[c] = 1.0 - far if far < 1.0 else 0.0
        limit[c] = limits[1] * (away if away > 1.0 else 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_row(around, south, weights, sums, plane, count):  # type: ignore[no-untyped-def]
    """Add a row of neighbours to the sums of each cell, weighted by nearness and by the distance from the plane of the round before."""
    (row, centre), (near, limit) = around, weights
    for c in range(count):
        s, flat = _sums(sums, c), (centre[c], plane[c + H], plane[c + A], plane[c + B])
        s = _neighbour(row, c, (-2.0, south), flat, (near[c], limit[c]), s)
        s = _neighbour(row, c + 1, (-1.0, south), flat, (near[c + RUN], limit[c + RUN]), s)
        s = _neighbour(row, c + 2, (0.0, south), flat, (near[c + 2 * RUN], limit[c + 2 * RUN]), s)
        s = _neighbour(row, c + 3, (1.0, south), flat, (near[c + 3 * RUN], limit[c + 3 * RUN]), s)
        s = _neighbour(row, c + 4, (2.0, south), flat, (near[c + 4 * RUN], limit[c + 4 * RUN]), s)
        _keep(sums, c, s)


@njit(cache=True, nogil=True, error_model="numpy")
def _neighbour(row, i, step, flat, weights, s):  # type: ignore[no-untyped-def]
    (base, h, a, b), (near, limit) = flat, weights
    x, y, d = step[0] + row[i + EAST], step[1] + row[i + SOUTH], row[i] - base
    return _added(s, (x, y, d), near, (d - h - a * x - b * y) / limit, row[i + SUPPORT])


@njit(cache=True, nogil=True)
def _added(s, place, near, off, support):  # type: ignore[no-untyped-def]
    x, y, d = place
    w = near * (1 - off * off) * (1 - off * off) * support if abs(off) < 1 else 0.0
    wx, wy = w * x, w * y
    return (
        s[0] + w, s[1] + wx, s[2] + wy, s[3] + w * d, s[4] + wx * x, s[5] + wx * y, s[6] + wy * y, s[7] + wx * d, s[8] + wy * d,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _sums(sums, c):  # type: ignore[no-untyped-def]
    """Of a cell: weights, then weights times x, y, z, xx, xy, yy, xz, yz."""
    return (
        sums[c], sums[c + RUN], sums[c + 2 * RUN], sums[c + 3 * RUN], sums[c + 4 * RUN], sums[c + 5 * RUN], sums[c + 6 * RUN],
        sums[c + 7 * RUN], sums[c + 8 * RUN],
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _keep(sums, c, s):  # type: ignore[no-untyped-def]
    sums[c], sums[c + RUN], sums[c + 2 * RUN], sums[c + 3 * RUN] = s[0], s[1], s[2], s[3]
    sums[c + 4 * RUN], sums[c + 5 * RUN], sums[c + 6 * RUN], sums[c + 7 * RUN], sums[c + 8 * RUN] = (
        s[4],
        s[5],
        s[6],
        s[7],
        s[8],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(sums, plane, count):  # type: ignore[no-untyped-def]
    """Planes from sums; a cell without any weight keeps the one that it has to the end."""
    for c in range(count):
        n, sx, sy, sz, sxx, sxy, syy, sxz, syz = _sums(sums, c)
        mx, my, mz = sx / n, sy / n, sz / n
        # a little stiffness: a lone cell, or a row of them, has no tilt of its own
        p, q, s = sxx / n - mx * mx + 0.05, sxy / n - mx * my, syy / n - my * my + 0.05
        e, f = sxz / n - mx * mz, syz / n - my * mz
        det = p * s - q * q
        a, b = (e * s - f * q) / det, (f * p - e * q) / det
        h = mz - a * mx - b * my
        more = n > 0.0 and plane[OPEN + c] > 0.0
        plane[A + c] = a if more else plane[A + c]
        plane[B + c] = b if more else plane[B + c]
        plane[H + c] = h if more else plane[H + c]
        plane[OPEN + c] = 1.0 if more else 0.0


def without_specks(z: FloatArray, step: float, least_cells: int) -> BoolArray:
    """(rows, cols) True where a cell belongs to a smooth patch of at least `least_cells` cells (4 neighbours, no step above `step` metres)."""
    return np.asarray(_patches(z, step, least_cells))


@njit(cache=True, nogil=True)
def _patches(z: FloatArray, step: float, least: int) -> BoolArray:
    rows, cols = z.shape
    done, kept = np.zeros((rows, cols), np.bool_), np.zeros((rows, cols), np.bool_)
    queue = np.empty((rows * cols, 2), np.int32)
    for r in range(rows):
        for c in range(cols):
            if done[r, c] or np.isnan(z[r, c]):
                continue
            done[r, c] = True
            queue[0, 0], queue[0, 1] = r, c
            head, n = 0, 1
            while head < n:
                i, j = queue[head, 0], queue[head, 1]
                head += 1
                for d in range(4):
                    k, m = i + (d == 0) - (d == 1), j + (d == 2) - (d == 3)
                    if k < 0 or m < 0 or k >= rows or m >= cols or done[k, m] or np.isnan(z[k, m]):
                        continue
                    if abs(z[k, m] - z[i, j]) <= step:
                        done[k, m] = True
                        queue[n, 0], queue[n, 1] = k, m
                        n += 1
            if n >= least:
                for i in range(n):
                    kept[queue[i, 0], queue[i, 1]] = True
    return kept
