"""Depths of all partners brought into the geometry of the reference image and merged by consistency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.matching.rectification import LEAST_FAN, Rectification

DISPARITY_SIGMA_PX = 0.35
"""Standard deviation of a disparity; depths of the rendered town scatter by 0.38 ground pixels (docs/matching.md)."""
AGREEMENT_SIGMAS = 3.0
"""Depths agree within so many of their common standard deviations: the usual bound of gross errors."""
MOST_SIGMA_GSD = 8.0
"""Depths of a pair that are expected to be less precise are left out, ground pixels; set by hand on images of the synthetic town."""
LONE_FACTOR = 2.0
"""A depth of one partner only is expected to be so many times less precise; set by hand on images of the synthetic town."""


class MergeParameters(Parameters):
    """How depths of several partners become one."""

    views_at_least: int = Field(
        1, ge=1, le=8, description="partners that must agree, where at least so many see the pixel"
    )


class _Geometry(NamedTuple):
    """Of a `Rectification`: its turn, focal length, fan, the lattice's first column and row, the base line, and the partner's plane."""

    cos: float
    sin: float
    focal: float
    fan: float
    col_0: float
    row_0: float
    base_x: float
    base_y: float
    base_z: float
    plane_x: float
    plane_y: float
    plane_z: float


def depths_of_pair(
    pair: Rectification,
    normal: FloatArray,
    disparity: Float32Array,
    corner: tuple[int, int],
    sigma_px: float,
    most_sigma: float,
) -> tuple[Float32Array, Float32Array]:
    """Depth and its expected standard deviation at pixels of the reference image.

    Parameters
    ----------
    normal : (h, w, 2) undistorted normalised coordinates of the pixels
    disparity : (rows, cols) float32 disparities at level 0 of a region of the rectified lattice
    corner : row and column of that region's first pixel
    sigma_px : standard deviation of a disparity
    most_sigma : depths with a larger standard deviation are left out, metres

    Returns
    -------
    depth, sigma : (h, w) float32, metres; NaN where unknown
    """
    numbers = (*pair.turn, pair.focal, pair.fan, *pair.origin, *pair.baseline, *pair.plane)
    return _depths(normal, disparity, corner, _Geometry(*map(float, numbers)), sigma_px, LEAST_FAN, most_sigma)


@njit(cache=True, nogil=True, error_model="numpy")
def _depth(u, v_row, d, g):  # type: ignore[no-untyped-def]
    """Depth of the point that a ray of the reference image at rectified (u, v_row) meets with the partner's ray at u - d."""
    rx = u / g.focal
    qu = u - d
    qx, qy = qu / g.focal, v_row * (1.0 - qu * g.fan) / g.focal
    t = 1.0 / (g.plane_x * qx + g.plane_y * qy + g.plane_z)
    sx, sz = t * qx - g.base_x, t - g.base_z
    return (g.base_x * sz - g.base_z * sx) / (rx * sz - sx)


@njit(cache=True, nogil=True)
def _disparity_at(disparity, y, x):  # type: ignore[no-untyped-def]
    """Bilinear between neighbours of one surface; the nearest one where they are of two, or one is missing."""
    rows, cols = disparity.shape
    i, j = int(np.floor(y)), int(np.floor(x))
    if i < 0 or j < 0 or i + 1 >= rows or j + 1 >= cols:
        return np.nan
    a, b, c, d = disparity[i, j], disparity[i, j + 1], disparity[i + 1, j], disparity[i + 1, j + 1]
    fy, fx = y - i, x - j
    low, high = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
    if high - low <= 1.5:  # False with NaN among them
        return (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy
    if fy < 0.5:
        return a if fx < 0.5 else b
    return c if fx < 0.5 else d


@njit(cache=True, nogil=True, error_model="numpy")
def _depths(normal, disparity, corner, g, sigma_px, least_fan, most_sigma):  # type: ignore[no-untyped-def]
    """Row by row, so that loops but the one that looks up disparities become vector instructions."""
    h, w = normal.shape[0], normal.shape[1]
    depth, sigma = np.empty((h, w), np.float32), np.empty((h, w), np.float32)
    u, v_row, d = np.empty(w), np.empty(w), np.empty(w)
    for i in range(h):
        for j in range(w):
            x, y = normal[i, j, 0], normal[i, j, 1]
            u[j] = g.focal * (g.cos * x + g.sin * y)
            fan = 1.0 - u[j] * g.fan
            v_row[j] = g.focal * (g.cos * y - g.sin * x) / fan if fan >= least_fan else np.nan
        for j in range(w):
            d[j] = np.nan
            if not np.isnan(v_row[j]):
                d[j] = _disparity_at(disparity, v_row[j] - g.row_0 - 0.5 - corner[0], u[j] - g.col_0 - 0.5 - corner[1])
        for j in range(w):
            z = _depth(u[j], v_row[j], d[j], g)
            spread = abs(_depth(u[j], v_row[j], d[j] + 0.5, g) - _depth(u[j], v_row[j], d[j] - 0.5, g)) * sigma_px
            known = (z > 0) & (spread <= most_sigma)  # False with NaN
            depth[i, j] = z if known else np.nan
            sigma[i, j] = spread if known else np.nan
    return depth, sigma


def merged(
    depths: Sequence[Float32Array], sigmas: Sequence[Float32Array], parameters: MergeParameters
) -> tuple[Float32Array, Float32Array, ByteArray]:
    """The largest set of partners that agree at each pixel: their weighted mean depth, its sigma, and their number.

    Of sets of the same size the one with the smaller sigma is taken.
    """
    p = parameters
    return _merged(np.stack(depths), np.stack(sigmas), AGREEMENT_SIGMAS, p.views_at_least, LONE_FACTOR)


@njit(cache=True, nogil=True)
def _merged(depths, sigmas, agreement, views_at_least, lone_factor):  # type: ignore[no-untyped-def]
    n, h, w = depths.shape
    depth = np.full((h, w), np.nan, np.float32)
    sigma = np.full((h, w), np.nan, np.float32)
    views = np.zeros((h, w), np.uint8)
    for i in range(h):
        for j in range(w):
            best, best_weight, best_mean, seen = 0, 0.0, 0.0, 0
            for a in range(n):
                z = depths[a, i, j]
                if np.isnan(z):
                    continue
                seen += 1
                count, weight, total = 0, 0.0, 0.0
                for b in range(n):
                    other = depths[b, i, j]
                    if np.isnan(other):
                        continue
                    variance = sigmas[b, i, j] ** 2
                    if (other - z) ** 2 <= agreement**2 * (variance + sigmas[a, i, j] ** 2):
                        count += 1
                        weight += 1.0 / variance
                        total += (other - z) / variance
                if count > best or (count == best and weight > best_weight):
                    best, best_weight, best_mean = count, weight, z + total / weight
            if best >= min(views_at_least, max(seen, 1)) and best > 0:
                depth[i, j] = best_mean
                sigma[i, j] = np.sqrt(1.0 / best_weight) * (lone_factor if best == 1 else 1.0)
                views[i, j] = best
    return depth, sigma, views
