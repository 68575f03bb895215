"""Sub-pixel disparities by least squares on the grey values.

Semi-global matching leaves disparities that are drawn to whole pixels and scatter by a quarter of one. Each is averaged with its neighbours of the same
surface; then the shift that is left between the base and the partner drawn to it is solved for in a window.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters

AVERAGE_PX = 4
"""Radius of the window that disparities are averaged in; set by hand on images of the synthetic town, as are the next four."""
WINDOW_PX = 5
"""Radius of the window that grey values are compared in."""
SAME_SURFACE_PX = 1.0
"""Disparities this near to each other belong to one surface."""
DAMPING = 8.0
"""Mean square gradient at which a window's shift is halved, grey values squared."""
MOST_SHIFT_PX = 0.75
"""Largest correction."""


class SubpixelParameters(Parameters):
    """Least-squares refinement of disparities at the finest level."""

    steps: int = Field(
        1, ge=0, le=5, description="least-squares steps; 0 leaves the disparities as the matcher gives them"
    )


def refined(
    reference: ByteArray, partner: ByteArray, disparity: Float32Array, highest: int, parameters: SubpixelParameters
) -> Float32Array:
    """Disparities after averaging and least squares.

    Parameters
    ----------
    reference : (rows, cols) rectified grey;  partner : (rows, more) the same rows; pixel x with disparity d is at column x - d + highest
    disparity : (rows, cols) float32, NaN where unknown
    """
    p = parameters
    if not p.steps:
        return disparity
    smooth = _averaged(disparity, AVERAGE_PX, SAME_SURFACE_PX)
    known = np.isfinite(smooth)
    one = _one_surface(smooth, known)
    start = smooth.copy()
    for _ in range(p.steps):
        shift = _shift(reference, partner, smooth, highest, known)
        shift[~one] = 0.0
        smooth = np.clip(smooth + shift, start - np.float32(MOST_SHIFT_PX), start + np.float32(MOST_SHIFT_PX))
    return smooth


def _one_surface(disparity: Float32Array, known: BoolArray) -> BoolArray:
    """Where all known disparities of a window belong to one surface, be it a slanted one."""
    kernel = np.ones((2 * WINDOW_PX + 1,) * 2, np.uint8)
    low = cv2.erode(np.where(known, disparity, np.float32(1e6)), kernel)
    high = cv2.dilate(np.where(known, disparity, np.float32(-1e6)), kernel)
    return np.asarray(high - low < SAME_SURFACE_PX * (1 + WINDOW_PX))


def _shift(
    reference: ByteArray, partner: ByteArray, disparity: Float32Array, highest: int, known: BoolArray
) -> Float32Array:
    """What is left between the two images, per pixel."""
    terms = _terms(reference, partner, disparity, highest)
    size = (2 * WINDOW_PX + 1,) * 2
    count, g, e, gg, ge = (cv2.boxFilter(t, -1, size, borderType=cv2.BORDER_REPLICATE) for t in terms)
    shift = _solved(count, g, e, gg, ge, np.float32(DAMPING))
    shift[~known] = 0.0
    return shift


@njit(cache=True, nogil=True, error_model="numpy")
def _averaged(disparity, radius, near):  # type: ignore[no-untyped-def]
    rows, cols = disparity.shape
    out = np.full(disparity.shape, np.nan, np.float32)
    wide = np.full((rows + 2 * radius, cols + 2 * radius), np.nan, np.float32)
    wide[radius : radius + rows, radius : radius + cols] = disparity
    total, weight = np.empty(cols, np.float32), np.empty(cols, np.float32)
    for i in range(rows):
        own = disparity[i]
        total[:] = own
        weight[:] = 1.0
        # pairs on opposite sides only, so that slanted surfaces keep their place
        for k in range(-radius, radius + 1):
            for m in range(radius + 1):
                if m == 0 and k <= 0:
                    continue
                ahead = wide[i + radius + k, radius + m : radius + m + cols]
                back = wide[i + radius - k, radius - m : radius - m + cols]
                limit = np.float32(near * (1.0 + 0.25 * (abs(k) + m)))
                for j in range(cols):
                    a, b = ahead[j], back[j]
                    same = (abs(a - own[j]) <= limit) & (abs(b - own[j]) <= limit)
                    total[j] += a + b if same else np.float32(0.0)
                    weight[j] += np.float32(2.0) if same else np.float32(0.0)
        for j in range(cols):
            out[i, j] = total[j] / weight[j]
    return out


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def _terms(reference, partner, disparity, highest):  # type: ignore[no-untyped-def]
    """Count, gradient, difference, and their products; all 0 where there is no disparity."""
    rows, cols = reference.shape
    wide = partner.shape[1]
    out = np.zeros((5, rows, cols), np.float32)
    for i in range(rows):
        for j in range(1, cols - 1):
            d = disparity[i, j]
            x = j + highest - d
            # False with NaN, too
            if not (x >= 1.0 and x < wide - 3.0):
                continue
            k = int(x)
            t = x - k
            a, b = np.float32(partner[i, k - 1]), np.float32(partner[i, k])
            c, e = np.float32(partner[i, k + 1]), np.float32(partner[i, k + 2])
            # Catmull-Rom: value and slope
            c1, c2, c3 = 0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * e, 0.5 * (e - a) + 1.5 * (b - c)
            value = b + t * (c1 + t * (c2 + t * c3))
            slope = c1 + t * (2.0 * c2 + t * 3.0 * c3)
            g = 0.5 * (slope + 0.5 * (np.float32(reference[i, j + 1]) - np.float32(reference[i, j - 1])))
            difference = value - np.float32(reference[i, j])
            out[0, i, j] = 1.0
            out[1, i, j] = g
            out[2, i, j] = difference
            out[3, i, j] = g * g
            out[4, i, j] = g * difference
    return out


@njit(cache=True, nogil=True, fastmath=True)
def _solved(count, g, e, gg, ge, damping):  # type: ignore[no-untyped-def]
    """Shift that minimises the squared differences about their mean in each window."""
    out = np.zeros(count.shape, np.float32)
    for i in range(count.shape[0]):
        for j in range(count.shape[1]):
            n = count[i, j]
            if n < 0.3:
                continue
            variance = (gg[i, j] - g[i, j] * g[i, j] / n) / n
            shift = (ge[i, j] - g[i, j] * e[i, j] / n) / n / (variance + damping)
            out[i, j] = min(max(shift, np.float32(-0.5)), np.float32(0.5))
    return out
