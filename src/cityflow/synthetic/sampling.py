"""Which rays go through an image: one per pixel first, more where a pixel sees more than one thing."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.kernels import njit
from cityflow.synthetic.caster import Surfaces
from cityflow.synthetic.procedural_textures import LEAF

SPLINE_STEP_PX = 32
BEND = 0.25
"""Depths of three pixels in a row are one plane's where they are off by no more than this share of a pixel's width."""


class RayField:
    """Directions through an image; a lens's distortion is solved on a lattice and splined between, far below 1e-4 pixels off."""

    def __init__(self, image: OrientedImage) -> None:
        camera = image.camera
        self.image, self.splines = image, None
        if not camera.is_pinhole:
            from scipy.interpolate import RectBivariateSpline  # takes long to load

            # a little beyond the image, since its outermost pixels are compared with their neighbours outside
            u = np.linspace(-2.0, camera.width + 2.0, max(camera.width // SPLINE_STEP_PX, 24))
            v = np.linspace(-2.0, camera.height + 2.0, max(camera.height // SPLINE_STEP_PX, 24))
            grid = np.stack(np.meshgrid(u, v), axis=-1)
            normal = camera.undistort(grid.reshape(-1, 2)).reshape(grid.shape)
            self.splines = [RectBivariateSpline(v, u, normal[..., i]) for i in range(2)]

    def lattice(self, v: FloatArray, u: FloatArray) -> FloatArray:
        """(len(v) · len(u), 3) world directions, depth component 1, through image coordinates, row by row."""
        camera = self.image.camera
        if self.splines is not None:
            x, y = (spline(v, u) for spline in self.splines)
        else:
            x, y = np.meshgrid((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy)
        return self._turned(x, y)

    def points(self, v: FloatArray, u: FloatArray) -> FloatArray:
        """(N, 3) world directions, depth component 1, through (N,) image coordinates."""
        camera = self.image.camera
        if self.splines is not None:
            x, y = (spline.ev(v, u) for spline in self.splines)
        else:
            x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
        return self._turned(x, y)

    def _turned(self, x: FloatArray, y: FloatArray) -> FloatArray:
        r = self.image.rotation
        out = np.empty((*x.shape, 3))
        for j in range(3):
            out[..., j] = x * r[0, j] + y * r[1, j] + r[2, j]
        return out.reshape(-1, 3)


def within_pixels(rows: IntArray, cols: IntArray, n: int) -> tuple[FloatArray, FloatArray]:
    """(N · n²,) image coordinates v, u of n × n samples in each of N pixels; a pixel's samples follow each other."""
    offset = (np.arange(n) + 0.5) / n
    v = rows[:, None] + np.repeat(offset, n)[None, :]
    u = cols[:, None] + np.tile(offset, n)[None, :]
    return v.ravel(), u.ravel()


@njit(cache=True, nogil=True)
def simple_pixels(triangle: IntArray, depth: FloatArray, lit: BoolArray, surfaces: Surfaces, pixel: float) -> BoolArray:
    """(h, w) of (h + 2, w + 2): pixels whose neighbours all show the same smooth surface in the same light.

    Parameters
    ----------
    triangle, depth, lit : what is seen at the centres of pixels, with a ring of one pixel around
    pixel : width of a pixel at depth 1
    """
    h, w = triangle.shape
    out = np.zeros((h - 2, w - 2), np.bool_)
    for r in range(1, h - 1):
        for c in range(1, w - 1):
            k = triangle[r, c]
            if k < 0 or surfaces.material[k] == LEAF:
                continue
            same = True
            for i in range(-1, 2):
                for j in range(-1, 2):
                    m = triangle[r + i, c + j]
                    if m == k:
                        same = same and lit[r + i, c + j] == lit[r, c]
                        continue
                    same = same and m >= 0 and lit[r + i, c + j] == lit[r, c]
                    same = same and surfaces.seed[m] == surfaces.seed[k] and surfaces.part[m] == surfaces.part[k]
                    same = same and surfaces.material[m] == surfaces.material[k]
            if not same:
                continue
            # over a plane the inverse of depth is linear in image coordinates
            limit, here = BEND * pixel, 2.0 / depth[r, c]
            across = abs(1.0 / depth[r, c - 1] + 1.0 / depth[r, c + 1] - here) * depth[r, c]
            down = abs(1.0 / depth[r - 1, c] + 1.0 / depth[r + 1, c] - here) * depth[r, c]
            out[r - 1, c - 1] = across < limit and down < limit
    return out
