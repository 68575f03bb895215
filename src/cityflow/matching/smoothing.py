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


@njit(cache=True, nogil=True)
def _bilateral(depth, radius, distance, spread):  # type: ignore[no-untyped-def]
    h, w = depth.shape
    out = depth.copy()
    inverse = np.float32(-0.5) / (spread * spread)
    space = np.empty((radius + 1, 2 * radius + 1), np.float32)
    for m in range(radius + 1):
        for k in range(-radius, radius + 1):
            space[m, k + radius] = np.exp(-0.5 * (k * k + m * m) / distance**2)
    for i in range(radius, h - radius):
        for j in range(radius, w - radius):
            z = depth[i, j]
            if np.isnan(z):
                continue
            total, weight = np.float32(0.0), np.float32(0.5)
            for m in range(0, radius + 1):
                for k in range(-radius, radius + 1):
                    if m == 0 and k <= 0:
                        continue
                    a, b = depth[i + k, j + m] - z, depth[i - k, j - m] - z
                    middle, bend = np.float32(0.5) * (a + b), np.float32(0.5) * (a - b)
                    # a slant bends nothing: what counts is how far the middle of the pair lies off, and that no step is between
                    if abs(bend) <= np.float32(4.0) * spread * np.float32(0.5 + 0.5 * (abs(k) + m)):
                        s = np.exp(inverse * middle * middle) * space[m, k + radius]
                        total += s * middle
                        weight += s
            out[i, j] = z + total / weight
    return out


@njit(cache=True, nogil=True)
def _mixed(depth, gsd, steepest, support):  # type: ignore[no-untyped-def]
    h, w = depth.shape
    out = np.zeros((h, w), np.bool_)
    reach = gsd * max(min(steepest, np.float32(4.0)), np.float32(2.0)) * np.float32(1.3)
    for i in range(2, h - 2):
        for j in range(2, w - 2):
            z = depth[i, j]
            if np.isnan(z):
                continue
            n, sx, sy, sz, sxx, sxy, syy, sxz, syz = 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(-2, 3):
                for m in range(-2, 3):
                    d = depth[i + k, j + m] - z
                    if abs(d) <= reach * max(abs(k), abs(m), 1):
                        n += 1
                        sx += m
                        sy += k
                        sz += d
                        sxx += m * m
                        sxy += k * m
                        syy += k * k
                        sxz += m * d
                        syz += k * d
            if n - 1 < support:
                out[i, j] = True
                continue
            sxx, sxy, syy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
            sxz, syz = sxz - sx * sz / n, syz - sy * sz / n
            det = sxx * syy - sxy * sxy
            if det > 1e-3:
                a, b = (sxz * syy - syz * sxy) / det, (syz * sxx - sxz * sxy) / det
                out[i, j] = a * a + b * b > (steepest * gsd) ** 2
    return out
