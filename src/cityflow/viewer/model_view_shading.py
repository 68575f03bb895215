"""Finished pixels of triangles that have been put into a depth buffer: ground, shadows, dark edges, and finer pixels made coarser, in one pass."""

from __future__ import annotations

import numpy as np

from cityflow.core.kernels import njit

TERRAIN, NO_FACE = -1, -2
"""Numbers of faces that are none of a model's."""
SHADOW = 0.62
"""Brightness of what the sun does not see."""
EDGE = 0.6
"""How much of the light an edge at full strength takes."""
SHADOW_M, SHADOW_PIXELS = 0.3, 2.0
"""What is nearer to the sun by more than this, and so many pixels of the sun's own view, casts a shadow."""
GROUND_SHARE, GROUND_LIGHT = 0.65, 235.0
"""The ground's own colours are lightened, so that the models stand out."""


@njit(cache=True, nogil=True)
def shaded(scene, view, sun, ground, edge_strength, finer):  # type: ignore[no-untyped-def]
    """(rows, cols, 3) float64 means of `finer` × `finer` pixels.

    Parameters
    ----------
    scene : depth (R, C) float32 and triangle (R, C) int32 of the viewer, −1 where there is none; colours (T, 3), light (T,) and faces (T,) of the
        triangles; (3,) colour of the sky
    view : (3, 3) axes right, up and forward; (2,) lowest right and up, metres; pixel, metres
    sun : the same, and the (R, C) depth of what it sees
    ground : (rows, cols, 3) uint8 colours of the terrain, x of the west, y of the north, cell, metres; of no rows where it has none
    edge_strength : 0 to 1
    """
    depth, triangle, colours, light, faces, sky = scene
    axes, low, pixel = view
    sun_axes, sun_low, sun_pixel, nearest = sun
    pixels, west, north, cell = ground
    out = np.zeros((depth.shape[0] // finer, depth.shape[1] // finer, 3))
    for row in range(out.shape[0] * finer):
        for col in range(out.shape[1] * finer):
            r, c, t = row // finer, col // finer, triangle[row, col]
            if t < 0:
                for band in range(3):
                    out[r, c, band] += sky[band]
                continue
            right, up = low[0] + (col + 0.5) * pixel, low[1] + (depth.shape[0] - row - 0.5) * pixel
            x, y, z = _spot(axes, right, up, depth[row, col])
            bright = light[t]
            if _in_shadow(x, y, z, sun_axes, sun_low, sun_pixel, nearest):
                bright *= SHADOW
            if _on_edge(row, col, triangle, faces):
                bright *= 1.0 - EDGE * edge_strength
            i, j = -1, -1
            if faces[t] == TERRAIN:
                i, j = int(np.floor((north - y) / cell)), int(np.floor((x - west) / cell))
            draped = 0 <= i < pixels.shape[0] and 0 <= j < pixels.shape[1]
            for band in range(3):
                own = colours[t, band]
                if draped:
                    own = GROUND_SHARE * pixels[i, j, band] + (1.0 - GROUND_SHARE) * GROUND_LIGHT
                out[r, c, band] += own * bright
    return out / (finer * finer)


@njit(cache=True, nogil=True)
def _spot(axes, right, up, forward):  # type: ignore[no-untyped-def]
    """x, y, z of what a pixel shows."""
    return (
        right * axes[0, 0] + up * axes[1, 0] + forward * axes[2, 0],
        right * axes[0, 1] + up * axes[1, 1] + forward * axes[2, 1],
        right * axes[0, 2] + up * axes[1, 2] + forward * axes[2, 2],
    )


@njit(cache=True, nogil=True)
def _in_shadow(x, y, z, axes, low, pixel, nearest):  # type: ignore[no-untyped-def]
    """Whether something is nearer to the sun than a point."""
    right = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
    up = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
    away = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
    rows, cols = nearest.shape
    col = min(max(int(np.floor((right - low[0]) / pixel)), 0), cols - 1)
    row = min(max(int(np.floor(rows - (up - low[1]) / pixel)), 0), rows - 1)
    return away - nearest[row, col] > SHADOW_M + SHADOW_PIXELS * pixel


@njit(cache=True, nogil=True)
def _on_edge(row, col, triangle, faces):  # type: ignore[no-untyped-def]
    """Whether the pixel to the right or below shows another face, and one of both is a model's."""
    here = _face(row, col, triangle, faces)
    if col + 1 < triangle.shape[1]:
        there = _face(row, col + 1, triangle, faces)
        if here != there and (here >= 0 or there >= 0):
            return True
    if row + 1 < triangle.shape[0]:
        there = _face(row + 1, col, triangle, faces)
        return here != there and (here >= 0 or there >= 0)
    return False


@njit(cache=True, nogil=True)
def _face(row, col, triangle, faces):  # type: ignore[no-untyped-def]
    return faces[triangle[row, col]] if triangle[row, col] >= 0 else NO_FACE
