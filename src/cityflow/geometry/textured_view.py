"""Pictures of textured triangles from a given camera: a depth buffer, and a division per pixel.

Texture coordinates are triplets (u, v, d): what is interpolated is (u·d, v·d, d), divided per pixel (Frommholz 2017, equation 1; Low 2002), so patches in the
geometry of their photograph and rectified ones (d = 1) are shown right by the same lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.kernels import njit

NEAREST_M = 0.05
"""Triangles nearer to the camera are not drawn."""
EMPTY = -1


@dataclass(frozen=True, slots=True, eq=False)
class TexturedTriangles:
    """What is drawn.

    Attributes
    ----------
    xyz : (C, 3) world metres of corners
    uvd : (C, 3) u from the left and v from below, 0 to 1, d in metres
    triangles : (T, 3) positions among the corners
    page : (T,) index among `pages`, -1 where a triangle has only a colour
    colour : (T, 3) 0 to 255
    pages : (rows, cols, 3) uint8 each
    """

    xyz: FloatArray
    uvd: FloatArray
    triangles: IntArray
    page: IntArray
    colour: IntArray
    pages: Sequence[NDArray[np.uint8]]


@dataclass(frozen=True, slots=True, eq=False)
class TexturedView:
    """What a camera sees.

    Attributes
    ----------
    colour : (rows, cols, 3) float32, 0 to 255
    depth : (rows, cols) float32, metres along the axis; infinite where nothing is
    triangle : (rows, cols) int32, -1 where nothing is
    """

    colour: Float32Array
    depth: Float32Array
    triangle: NDArray[np.int32]


def draw_textured(image: OrientedImage, scene: TexturedTriangles, *, divide: bool = True) -> TexturedView:
    """The triangles as a camera without distortion sees them; triangles that reach behind it are left out.

    Parameters
    ----------
    divide : False interpolates u and v as they are, as renderers without triplets do
    """
    camera = image.camera
    local = image.in_camera(scene.xyz)
    z = local[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        uv = np.column_stack([camera.fx * local[:, 0] / z + camera.cx, camera.fy * local[:, 1] / z + camera.cy])
    shape = camera.height, camera.width
    depth, triangle = np.full(shape, np.inf, np.float32), np.full(shape, EMPTY, np.int32)
    _fill(uv, z, np.ascontiguousarray(scene.triangles, np.int64), depth, triangle)
    colour = np.zeros((*shape, 3), np.float32)
    texel = scene.uvd.copy()
    if not divide:
        texel[:, 2] = 1.0
    seen = np.where(triangle >= 0, scene.page[np.maximum(triangle, 0)], EMPTY - 1)
    plain = seen == EMPTY
    colour[plain] = scene.colour[triangle[plain]]
    for number, page in enumerate(scene.pages):
        rows, cols = np.nonzero(seen == number)
        if len(rows):
            colour[rows, cols] = _sampled(
                rows, cols, triangle[rows, cols].astype(np.int64), uv, z, scene.triangles.astype(np.int64), texel, page
            )
    return TexturedView(colour, depth, triangle)


@njit(cache=True, nogil=True)
def _fill(uv, z, triangles, depth, triangle):  # type: ignore[no-untyped-def]
    rows, cols = depth.shape
    for t in range(triangles.shape[0]):
        a, b, c = triangles[t]
        if z[a] <= NEAREST_M or z[b] <= NEAREST_M or z[c] <= NEAREST_M:
            continue
        ax, ay, bx, by, cx, cy = uv[a, 0], uv[a, 1], uv[b, 0], uv[b, 1], uv[c, 0], uv[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-12:
            continue
        first_row, last_row = (
            max(int(np.floor(min(ay, by, cy) - 0.5)), 0),
            min(int(np.ceil(max(ay, by, cy) + 0.5)), rows - 1),
        )
        first_col, last_col = (
            max(int(np.floor(min(ax, bx, cx) - 0.5)), 0),
            min(int(np.ceil(max(ax, bx, cx) + 0.5)), cols - 1),
        )
        for r in range(first_row, last_row + 1):
            y = r + 0.5
            for k in range(first_col, last_col + 1):
                x = k + 0.5
                wa = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                wb = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                wc = 1.0 - wa - wb
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                far = 1.0 / (wa / z[a] + wb / z[b] + wc / z[c])
                if far < depth[r, k]:
                    depth[r, k] = far
                    triangle[r, k] = t


@njit(cache=True, nogil=True)
def _sampled(rows, cols, of, uv, z, triangles, uvd, page):  # type: ignore[no-untyped-def]
    tall, wide = page.shape[0], page.shape[1]
    out = np.empty((rows.size, 3), np.float32)
    for i in range(rows.size):
        a, b, c = triangles[of[i]]
        x, y = cols[i] + 0.5, rows[i] + 0.5
        ax, ay, bx, by, cx, cy = uv[a, 0], uv[a, 1], uv[b, 0], uv[b, 1], uv[c, 0], uv[c, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        wa = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area / z[a]
        wb = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area / z[b]
        wc = ((ax - x) * (by - y) - (ay - y) * (bx - x)) / area / z[c]
        d = wa * uvd[a, 2] + wb * uvd[b, 2] + wc * uvd[c, 2]
        u = (wa * uvd[a, 2] * uvd[a, 0] + wb * uvd[b, 2] * uvd[b, 0] + wc * uvd[c, 2] * uvd[c, 0]) / d
        v = (wa * uvd[a, 2] * uvd[a, 1] + wb * uvd[b, 2] * uvd[b, 1] + wc * uvd[c, 2] * uvd[c, 1]) / d
        px, py = u * wide - 0.5, (1.0 - v) * tall - 0.5
        x_0, y_0 = int(np.floor(px)), int(np.floor(py))
        fx, fy = px - x_0, py - y_0
        left, right = min(max(x_0, 0), wide - 1), min(max(x_0 + 1, 0), wide - 1)
        top, low = min(max(y_0, 0), tall - 1), min(max(y_0 + 1, 0), tall - 1)
        for k in range(3):
            upper = (1 - fx) * page[top, left, k] + fx * page[top, right, k]
            lower = (1 - fx) * page[low, left, k] + fx * page[low, right, k]
            out[i, k] = (1 - fy) * upper + fy * lower
    return out
