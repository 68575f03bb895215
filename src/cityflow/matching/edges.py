"""Depth steps drawn to the edges of the image.

A window that straddles a step lets the surface with more texture grow over the other by a pixel or two. The base image knows better where a roof ends:
near a step each pixel joins the surface whose pixels around it look more like itself.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from pydantic import Field

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array
from cityflow.core.parameters import Parameters


class EdgeParameters(Parameters):
    """Alignment of depth steps with image edges."""

    rounds: int = Field(2, ge=0, le=5, description="how often pixels choose; 0 switches it off")
    radius_px: int = Field(4, ge=1, le=10, description="radius of the window that votes")
    step_gsd: float = Field(
        5.0, gt=0, le=100, description="depth change between neighbours' surfaces that is a step, ground pixels"
    )
    likeness: float = Field(10.0, gt=0, le=128, description="grey difference at which a vote has fallen to 0.6")
    inertia: float = Field(
        1.1, ge=1, le=10, description="how many times more votes another surface needs than the pixel's own"
    )


def at_image_edges(depth: Float32Array, grey: ByteArray, gsd: float, parameters: EdgeParameters) -> Float32Array:
    """Depths with pixels near steps moved to the surface that they look like.

    Parameters
    ----------
    depth : (h, w) float32, metres, NaN where unknown
    grey : (h, w) uint8 of the base image
    gsd : metres per pixel at the depth of the scene
    """
    p = parameters
    calm = cv2.medianBlur(np.ascontiguousarray(grey), 3)
    for _ in range(p.rounds):
        near = near_steps(depth, p.radius_px, np.float32(p.step_gsd * gsd))
        depth = _chosen(
            depth, calm, near, p.radius_px, np.float32(p.step_gsd * gsd), np.float32(p.likeness), np.float32(p.inertia)
        )
    return depth


def near_steps(depth: Float32Array, radius: int, step: np.float32) -> BoolArray:
    """Pixels within `radius` of two neighbours whose depths differ by more than a step."""
    known = np.isfinite(depth)
    kernel = np.ones((3, 3), np.uint8)
    low = cv2.erode(np.where(known, depth, np.float32(1e9)), kernel)
    high = cv2.dilate(np.where(known, depth, np.float32(-1e9)), kernel)
    size = 2 * radius - 1
    return np.asarray(cv2.dilate((high - low > step).astype(np.uint8), np.ones((size, size), np.uint8)) > 0)


@njit(cache=True, nogil=True, fastmath=False)
def _chosen(depth, grey, near, radius, step, likeness, inertia):  # type: ignore[no-untyped-def]
    h, w = depth.shape
    out = depth.copy()
    table = (np.exp(-0.5 * (np.arange(256) / likeness) ** 2) + 1e-3).astype(np.float32)
    for i in range(radius, h - radius):
        for j in range(radius, w - radius):
            if not near[i, j]:
                continue
            low, high = np.float32(1e9), np.float32(-1e9)
            for k in range(-radius, radius + 1):
                for m in range(-radius, radius + 1):
                    z = depth[i + k, j + m]
                    if not np.isnan(z):
                        low, high = min(low, z), max(high, z)
            if high - low <= step:
                continue
            split = _split(depth, i, j, radius, low, high)
            votes_near, votes_far = np.float32(0.0), np.float32(0.0)
            near_z, far_z, near_w, far_w = 0.0, 0.0, 0.0, 0.0
            own = np.int64(grey[i, j])
            for k in range(-radius, radius + 1):
                for m in range(-radius, radius + 1):
                    z = depth[i + k, j + m]
                    if np.isnan(z) or (k == 0 and m == 0):
                        continue
                    away = np.float32(k * k + m * m)
                    vote = table[abs(np.int64(grey[i + k, j + m]) - own)] / (np.float32(2.0) + away)
                    pull = vote / away
                    if z < split:
                        votes_near += vote
                        near_z += pull * z
                        near_w += pull
                    else:
                        votes_far += vote
                        far_z += pull * z
                        far_w += pull
            z = depth[i, j]
            if np.isnan(z):
                continue
            if z < split and votes_far > inertia * votes_near:
                out[i, j] = far_z / far_w
            elif z >= split and votes_near > inertia * votes_far:
                out[i, j] = near_z / near_w
    return out


@njit(cache=True, nogil=True)
def _split(depth, i, j, radius, low, high):  # type: ignore[no-untyped-def]
    """Depth between the two surfaces of a window: where the means of both sides are equally far."""
    split = 0.5 * (low + high)
    for _ in range(3):
        near, far, n, f = 0.0, 0.0, 0, 0
        for k in range(-radius, radius + 1):
            for m in range(-radius, radius + 1):
                z = depth[i + k, j + m]
                if np.isnan(z):
                    continue
                if z < split:
                    near += z
                    n += 1
                else:
                    far += z
                    f += 1
        if n == 0 or f == 0:
            break
        split = 0.5 * (near / n + far / f)
    return split
