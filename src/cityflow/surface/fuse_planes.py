"""Smoothing of the fused surface: neighbouring cells of one surface share their points; across a step they do not."""

from __future__ import annotations

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.kernels import njit
from cityflow.surface.fuse_modes import Modes

ROUNDS = 3
"""Of re-weighting a plane; set by hand."""


def on_planes(found: Modes, radius: float, band: float) -> FloatArray:
    """(rows, cols) height at each centre of the plane through the modes within `radius` (cells) that lie on one surface with it.

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


@njit(cache=True, nogil=True)
def _fit(
    z: FloatArray, u: Float32Array, v: Float32Array, support: Float32Array, radius: float, band: float, asked: BoolArray, out: FloatArray
) -> None:  # fmt: skip
    rows, cols = z.shape
    reach = int(radius)
    buffer = np.empty((5, (2 * reach + 1) ** 2))
    for r in range(rows):
        for c in range(cols):
            if asked[r, c]:
                out[r, c] = np.nan
                if not np.isnan(z[r, c]):
                    n = _around(r, c, z, u, v, support, radius, buffer)
                    out[r, c] = z[r, c] + _above(buffer, n, band)


@njit(cache=True, nogil=True)
def _around(
    r: int, c: int, z: FloatArray, u: Float32Array, v: Float32Array, support: Float32Array, radius: float, buffer: FloatArray
) -> int:  # fmt: skip
    """Places and heights of the modes around a cell, from it; nearness and support; how many there are."""
    rows, cols = z.shape
    reach = int(radius)
    base, n = z[r, c], 0
    for i in range(max(r - reach, 0), min(r + reach + 1, rows)):
        for j in range(max(c - reach, 0), min(c + reach + 1, cols)):
            if np.isnan(z[i, j]):
                continue
            x, y = j - c + u[i, j], i - r + v[i, j]
            far = (x * x + y * y) / ((radius + 0.5) * (radius + 0.5))
            if far < 1:
                buffer[0, n], buffer[1, n], buffer[2, n] = x, y, z[i, j] - base
                buffer[3, n], buffer[4, n] = 1 - far, support[i, j]
                n += 1
    return n


@njit(cache=True, nogil=True)
def _above(buffer: FloatArray, count: int, band: float) -> float:
    """Height of the plane over the mode of the cell."""
    a, b, h = 0.0, 0.0, 0.0
    for rounds in range(ROUNDS):
        n, sx, sy, sz, sxx, sxy, syy, sxz, syz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(count):
            x, y, d = buffer[0, k], buffer[1, k], buffer[2, k]
            limit = band * max(1.0, np.sqrt(x * x + y * y)) if rounds == 0 else band
            off = (d - h - a * x - b * y) / limit
            if abs(off) >= 1:
                continue
            w = buffer[3, k] * (1 - off * off) * (1 - off * off) * buffer[4, k]
            n, sx, sy, sz = n + w, sx + w * x, sy + w * y, sz + w * d
            sxx, sxy, syy = sxx + w * x * x, sxy + w * x * y, syy + w * y * y
            sxz, syz = sxz + w * x * d, syz + w * y * d
        if n <= 0:
            break
        mx, my, mz = sx / n, sy / n, sz / n
        # a little stiffness: a lone cell, or a row of them, has no tilt of its own
        p, q, s = sxx / n - mx * mx + 0.05, sxy / n - mx * my, syy / n - my * my + 0.05
        e, f = sxz / n - mx * mz, syz / n - my * mz
        det = p * s - q * q
        a, b = (e * s - f * q) / det, (f * p - e * q) / det
        h = mz - a * mx - b * my
    return h


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
