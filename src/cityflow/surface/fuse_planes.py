"""Smoothing of the fused surface: neighbouring cells of one surface share their points; across a step they do not."""

from __future__ import annotations

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
    return np.asarray(_fit(found.z, found.u, found.v, found.support, radius, band))


@njit(cache=True, nogil=True)
def _fit(
    z: FloatArray, u: Float32Array, v: Float32Array, support: Float32Array, radius: float, band: float
) -> FloatArray:
    rows, cols = z.shape
    out = np.full((rows, cols), np.nan)
    for r in range(rows):
        for c in range(cols):
            if not np.isnan(z[r, c]):
                out[r, c] = _height(r, c, z, u, v, support, radius, band)
    return out


@njit(cache=True, nogil=True)
def _height(
    r: int, c: int, z: FloatArray, u: Float32Array, v: Float32Array, support: Float32Array, radius: float, band: float
) -> float:
    rows, cols = z.shape
    reach = int(radius)
    base = z[r, c]
    a, b, h = 0.0, 0.0, 0.0
    for rounds in range(ROUNDS):
        n, sx, sy, sz, sxx, sxy, syy, sxz, syz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(max(r - reach, 0), min(r + reach + 1, rows)):
            for j in range(max(c - reach, 0), min(c + reach + 1, cols)):
                if np.isnan(z[i, j]):
                    continue
                x, y, d = j - c + u[i, j], i - r + v[i, j], z[i, j] - base
                far = (x * x + y * y) / ((radius + 0.5) * (radius + 0.5))
                if far >= 1:
                    continue
                limit = band * max(1.0, np.sqrt(x * x + y * y)) if rounds == 0 else band
                off = (d - h - a * x - b * y) / limit
                if abs(off) >= 1:
                    continue
                w = (1 - far) * (1 - off * off) * (1 - off * off) * support[i, j]
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
    return base + h


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
