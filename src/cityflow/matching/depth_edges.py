"""Moves depth steps to the edges of the image.

A window that straddles a step lets the surface with more texture grow over the other by a pixel or two. The reference image knows better where a roof ends:
near a step each pixel joins the surface whose pixels around it look more like itself.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters

STEP_GSD = 5.0
"""Depth change between neighbours' surfaces that is a step, ground pixels; set by hand on images of the synthetic town, as are the next three."""
SIMILARITY = 10.0
"""Grey difference at which a vote has fallen to 0.6."""
INERTIA = 1.1
"""How many times more votes another surface needs than the pixel's own."""
RADIUS_PX = 4
"""Radius of the filter's window: it is as wide as a census window, 9 pixels."""


class EdgeParameters(Parameters):
    """Alignment of depth steps with image edges."""

    rounds: int = Field(2, ge=0, le=5, description="rounds of the filter; 0 switches it off")


def at_image_edges(depth: Float32Array, grey: ByteArray, gsd: float, parameters: EdgeParameters) -> Float32Array:
    """Depths with pixels near steps moved to the surface that they look like.

    Parameters
    ----------
    depth : (h, w) float32, metres, NaN where unknown
    grey : (h, w) uint8 of the reference image
    gsd : metres per pixel at the depth of the scene
    """
    p = parameters
    calm = cv2.medianBlur(np.ascontiguousarray(grey), 3)
    for _ in range(p.rounds):
        near = near_steps(depth, RADIUS_PX, np.float32(STEP_GSD * gsd))
        depth = _chosen(
            depth, calm, near, RADIUS_PX, np.float32(STEP_GSD * gsd), np.float32(SIMILARITY), np.float32(INERTIA)
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


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _chosen(depth, grey, near, radius, step, similarity, inertia):  # type: ignore[no-untyped-def]
    h, w = depth.shape
    out = depth.copy()
    table = (np.exp(-0.5 * (np.arange(256) / similarity) ** 2) + 1e-3).astype(np.float32)
    edge = 2 * radius + 1
    size = edge * edge
    away = np.empty(size, np.float32)
    for k in range(edge):
        for m in range(edge):
            away[k * edge + m] = (k - radius) ** 2 + (m - radius) ** 2
    values, there, votes = np.empty(size, np.float32), np.empty(size, np.float32), np.empty(size, np.float32)
    flat, looks = depth.ravel(), grey.ravel()
    for i in range(radius, h - radius):
        for j in range(radius, w - radius):
            z = depth[i, j]
            if not near[i, j] or np.isnan(z):
                continue
            own = np.int64(grey[i, j])
            for k in range(edge):
                start = (i + k - radius) * w + j - radius
                for m in range(edge):
                    value, n = flat[start + m], k * edge + m
                    known = not np.isnan(value)
                    values[n] = value if known else z
                    there[n] = np.float32(known)
                    votes[n] = table[abs(np.int64(looks[start + m]) - own)]
            there[size // 2] = 0.0
            out[i, j] = _vote(values, there, votes, away, z, step, inertia)
    return out


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
def _vote(values, there, votes, away, z, step, inertia):  # type: ignore[no-untyped-def]
    """Depth of a pixel after its neighbours voted: its own, or the mean of the other surface, near neighbours first."""
    nothing, half, one = np.float32(0.0), np.float32(0.5), np.float32(1.0)
    low, high, count, whole = np.float32(1e9), np.float32(-1e9), nothing, nothing
    for n in range(values.size):
        low = min(low, values[n] if there[n] > nothing else np.float32(1e9))
        high = max(high, values[n] if there[n] > nothing else np.float32(-1e9))
        count += there[n]
        whole += there[n] * (values[n] - z)
    if not high - low > step:
        return z
    # depths count from the pixel's own: sums keep their digits
    split = half * (low + high) - z
    for _ in range(2):
        near, nearer = nothing, nothing
        for n in range(values.size):
            below = there[n] if values[n] - z < split else nothing
            near += below * (values[n] - z)
            nearer += below
        if nothing < nearer < count:
            split = half * (near / nearer + (whole - near) / (count - nearer))
    sign = nothing < split  # the pixel's own depth is the nearer one
    votes_own, votes_other, total, weight = nothing, nothing, nothing, np.float32(1e-12)
    for n in range(values.size):
        vote = there[n] * votes[n] / (np.float32(2.0) + away[n])
        same = (values[n] - z < split) == sign
        other = nothing if same else vote
        votes_own += vote - other
        votes_other += other
        near_other = other / max(away[n], one)
        total += near_other * (values[n] - z)
        weight += near_other
    return z + total / weight if votes_other > inertia * votes_own else z
