"""Edge-preserving smoothing of depth maps, and the removal of mixed pixels."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters

DISTANCE_PX = 3.0
"""Standard deviation of the bilateral filter's weights over pixel distance, half of its radius; set by hand on images of the synthetic town."""
DEPTH_GSD = 2.5
"""And over depth difference, ground pixels; set by hand on images of the synthetic town."""


class SmoothingParameters(Parameters):
    """Bilateral filter (Frommholz 2017, section 2) and mixed pixels (Nex 2013, section 2.2)."""

    radius_px: int = Field(6, ge=0, le=10, description="radius of the bilateral filter; 0 switches it off")
    grazing_deg: float = Field(
        20.0,
        ge=0,
        le=60,
        description="points whose surface makes a smaller angle with the viewing ray are removed; below 6 degrees, and with 0, only support decides",
    )
    support: int = Field(
        5, ge=0, le=24, description="a point stays if at least so many of its 24 neighbours lie on its surface"
    )


def smoothed(depth: Float32Array, gsd: float, parameters: SmoothingParameters) -> Float32Array:
    """Bilateral mean over pairs of opposite neighbours, so that slanted surfaces and steps keep their place."""
    p = parameters
    if not p.radius_px:
        return depth
    return _bilateral(depth, p.radius_px, DISTANCE_PX, np.float32(DEPTH_GSD * gsd))


def mixed_pixels(depth: Float32Array, gsd: float, parameters: SmoothingParameters) -> BoolArray:
    """Pixels whose local surface runs along the viewing ray, or that belong to no surface.

    The surface is the plane through those of the 24 neighbours that are near the point in space: nearer than the surface at the bounding angle goes.
    """
    p = parameters
    steepest = 1.0 / np.tan(np.radians(p.grazing_deg)) if p.grazing_deg else 1e6
    return _mixed(depth, np.float32(gsd), np.float32(steepest), p.support)


@njit(cache=True, nogil=True, error_model="numpy")
def _bilateral(depth, radius, distance, spread):  # type: ignore[no-untyped-def]
    h, w = depth.shape
    out = depth.copy()
    cols = w - 2 * radius
    if cols <= 0:
        return out
    one, half, sixth = np.float32(1.0), np.float32(0.5), np.float32(1.0 / 6.0)
    inverse = half / (spread * spread)
    total, weight = np.empty(cols, np.float32), np.empty(cols, np.float32)
    for i in range(radius, h - radius):
        own = depth[i, radius : radius + cols]
        total[:] = 0.0
        weight[:] = 0.5
        for m in range(radius + 1):
            for k in range(-radius, radius + 1):
                if m == 0 and k <= 0:
                    continue
                ahead = depth[i + k, radius + m : radius + m + cols]
                back = depth[i - k, radius - m : radius - m + cols]
                space = np.float32(np.exp(-0.5 * (k * k + m * m) / distance**2))
                most = np.float32(4.0 * spread * (0.5 + 0.5 * (abs(k) + m)))
                for j in range(cols):
                    a, b = ahead[j] - own[j], back[j] - own[j]
                    middle, bend = half * (a + b), half * (a - b)
                    # a slant bends nothing: what counts is how far the middle of the pair lies off, and that no step is between
                    same = abs(bend) <= most  # False with NaN
                    x = inverse * middle * middle
                    # the series of exp(x): a bell as good as its inverse, and fast
                    s = space / (one + x * (one + x * (half + x * sixth)))
                    total[j] += s * middle if same else np.float32(0.0)
                    weight[j] += s if same else np.float32(0.0)
        for j in range(cols):
            out[i, radius + j] = own[j] + total[j] / weight[j]
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _mixed(depth, gsd, steepest, support):  # type: ignore[no-untyped-def]
    h, w = depth.shape
    out = np.zeros((h, w), np.bool_)
    cols = w - 4
    if cols <= 0:
        return out
    reach = gsd * max(min(steepest, np.float32(4.0)), np.float32(2.0)) * np.float32(1.3)
    nothing = np.float32(0.0)
    sums = np.empty((9, cols), np.float32)
    count, sx, sy, sz, sxx, sxy, syy, sxz, syz = (
        sums[0],
        sums[1],
        sums[2],
        sums[3],
        sums[4],
        sums[5],
        sums[6],
        sums[7],
        sums[8],
    )
    for i in range(2, h - 2):
        own = depth[i, 2 : 2 + cols]
        sums[:] = 0.0
        for k in range(-2, 3):
            for m in range(-2, 3):
                other = depth[i + k, 2 + m : 2 + m + cols]
                most = np.float32(reach * max(abs(k), abs(m), 1))
                y, x = np.float32(k), np.float32(m)
                for j in range(cols):
                    d = other[j] - own[j]
                    near = abs(d) <= most  # False with NaN
                    one = np.float32(1.0) if near else nothing
                    d = d if near else nothing
                    count[j] += one
                    sx[j] += x * one
                    sy[j] += y * one
                    sz[j] += d
                    sxx[j] += x * x * one
                    sxy[j] += x * y * one
                    syy[j] += y * y * one
                    sxz[j] += x * d
                    syz[j] += y * d
        for j in range(cols):
            if np.isnan(own[j]):
                continue
            n = count[j]
            if n - 1 < support:
                out[i, 2 + j] = True
                continue
            xx, xy, yy = sxx[j] - sx[j] * sx[j] / n, sxy[j] - sx[j] * sy[j] / n, syy[j] - sy[j] * sy[j] / n
            xz, yz = sxz[j] - sx[j] * sz[j] / n, syz[j] - sy[j] * sz[j] / n
            det = xx * yy - xy * xy
            if det > 1e-3:
                a, b = (xz * yy - yz * xy) / det, (yz * xx - xz * xy) / det
                out[i, 2 + j] = a * a + b * b > (steepest * gsd) ** 2
    return out
