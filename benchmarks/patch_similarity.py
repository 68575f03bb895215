"""How alike photographs show patches of a roof that are moved up and down."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import ColourImage, cubic
from cityflow.core.kernels import njit
from cityflow.core.pixels import LUMA, PixelArray, level_shape

REACH_M, STEP_M = 2.0, 0.1
"""A patch is moved so far up and down, in steps; half of what counts as wrong."""
SHIFTS = np.linspace(-REACH_M, REACH_M, 2 * round(REACH_M / STEP_M) + 1)
"""(D,) metres upwards."""
SIDE = 9
"""Cells along a patch; set by hand, as are those below."""
ABOUT_MIDDLE = np.array([SIDE * (SIDE // 2 + r) + SIDE // 2 + c for r in (-1, 0, 1) for c in (-1, 0, 1)])
"""The nine cells amid a patch."""
WHITE, NOISE = 255.0, 1.0
"""The brightest value, and the variance that a surface without texture shows."""
LIKE = 4.0
"""Grey values, of 255: a cell that differs so much from the middle of its patch weighs 1 / e; of 4, 8, 15 and
no weights the first told right patches from wrong ones best (three flights; area under the curve 0.86, 0.84, 0.81, 0.75)."""
MARGIN_PX = 3
"""Of a window beyond what is looked up in it: the reach of the cubic."""
COARSER = 0.25
"""Levels; pixels may be so much larger than the cells of a patch."""


@dataclass(frozen=True, slots=True)
class View:
    """A photograph's window over a roof.

    Attributes
    ----------
    grey : (rows, cols, 1) values;  row, col : where it lies in its level
    """

    image: OrientedImage
    grey: Float32Array
    level: int
    row: int
    col: int

    def values(self, xyz: FloatArray) -> Float32Array:
        """(D, N) grey values of (N, 3) points, at all shifts."""
        at = [self.image.project(moved(xyz, z))[0] for z in (-REACH_M, 0.0, REACH_M)]
        t = SHIFTS[:, None, None] / REACH_M
        # along a plumb line coordinates are nearly linear
        uv = at[1] + t * (at[2] - at[0]) / 2.0 + t**2 * ((at[2] + at[0]) / 2.0 - at[1])
        scaled = uv.reshape(-1, 2) / (1 << self.level) - 0.5
        found = cubic(self.grey, scaled[:, 1] - self.row, scaled[:, 0] - self.col)
        return np.asarray(found.reshape(len(SHIFTS), len(xyz)))


def pixel_m(image: OrientedImage, xyz: FloatArray) -> float:
    """What a pixel of an image is wide at a place, metres."""
    return float(np.linalg.norm(image.centre - xyz)) / image.camera.fx


def moved(xyz: FloatArray, z: float) -> FloatArray:
    """(..., 3) places `z` metres higher."""
    return np.asarray(xyz + np.array([0.0, 0.0, z]))


def view_of(colour: ColourImage, ends: FloatArray, cell: float) -> View:
    """The part of an image that shows (N, 3) ends of patches at any shift, at the level whose pixels are nearly as large as `cell` (metres)."""
    image, pixels = colour.image, colour.pixels
    level = max(0, math.floor(math.log2(cell / pixel_m(image, ends[0])) + COARSER))
    uv = np.concatenate([image.project(moved(ends, z))[0] for z in (-REACH_M, REACH_M)]) / (1 << level)
    tall, wide = level_shape(pixels.height, pixels.width, level)
    (left, top), (right, bottom) = (
        np.floor(uv.min(axis=0)).astype(int) - MARGIN_PX,
        np.ceil(uv.max(axis=0)).astype(int) + MARGIN_PX,
    )
    rows, cols = (max(int(top), 0), min(int(bottom), tall)), (max(int(left), 0), min(int(right), wide))
    return View(
        image,
        _grey(pixels.window(rows, cols, level), colour.white or float(np.iinfo(pixels.dtype).max)),
        level,
        rows[0],
        cols[0],
    )


def _grey(window: PixelArray, white: float) -> Float32Array:
    """(rows, cols, 1) brightness, 0 to 255."""
    values = np.asarray(window, np.float32)
    parts = LUMA if window.shape[2] >= len(LUMA) else (1.0,)
    grey = np.zeros(window.shape[:2], np.float32)
    for k, part in enumerate(parts):
        grey += part * values[..., k]
    return np.ascontiguousarray(grey[..., None] * (WHITE / white), np.float32)


def alike(xyz: FloatArray, used: BoolArray, views: Mapping[int, View]) -> FloatArray:
    """(P, D) mean correlation of all pairs of the images that are used for a patch, at all shifts.

    Parameters
    ----------
    xyz : (P, C, 3) cells of patches, metres; NaN beyond the roof
    used : (P, images) which images are compared; `views` has those that any patch uses
    """
    those = np.flatnonzero(used.any(axis=0))
    held = np.isfinite(xyz[..., 2])
    points = np.where(held[..., None], xyz, xyz[:, xyz.shape[1] // 2][:, None])
    values = np.zeros((len(those), len(xyz), len(SHIFTS), xyz.shape[1]), np.float32)
    for n, k in enumerate(those):
        mine = used[:, k]
        found = views[int(k)].values(points[mine].reshape(-1, 3))
        values[n, mine] = found.reshape(len(SHIFTS), int(mine.sum()), -1).swapaxes(0, 1)
    return np.asarray(_correlation(values, used[:, those].T.copy(), held, ABOUT_MIDDLE))


@njit(cache=True, nogil=True)
def _correlation(values, used, held, about_middle):  # type: ignore[no-untyped-def]
    """(P, D) mean correlation of all pairs of (K, P, D, C) values.

    A cell weighs less the more its brightness, in the mean over the images, differs from that of the cells `about_middle`: an edge beside the place, of
    something higher or lower, would speak for its own height and not for that of the place.
    """
    _, patches, shifts, cells = values.shape
    out = np.zeros((patches, shifts))
    weight, mean, total = np.empty(cells), np.empty(cells), np.empty(cells)
    for p in range(patches):
        count = used[:, p].sum()
        for d in range(shifts):
            mean[:] = 0.0
            for k in range(values.shape[0]):
                if used[k, p]:
                    for c in range(cells):
                        mean[c] += values[k, p, d, c] / count
            middle, known, whole = 0.0, 0, 0.0
            for c in about_middle:
                if held[p, c]:
                    middle += mean[c]
                    known += 1
            for c in range(cells):
                weight[c] = np.exp(-abs(mean[c] - middle / known) / LIKE) if held[p, c] else 0.0
                whole += weight[c]
            weight /= whole
            total[:] = 0.0
            own = 0.0
            for k in range(values.shape[0]):
                if not used[k, p]:
                    continue
                level, square = 0.0, 0.0
                for c in range(cells):
                    level += weight[c] * values[k, p, d, c]
                for c in range(cells):
                    square += weight[c] * (values[k, p, d, c] - level) ** 2
                scale = 1.0 / np.sqrt(square + NOISE)
                own += square * scale * scale
                for c in range(cells):
                    total[c] += (values[k, p, d, c] - level) * scale
            out[p, d] = ((weight * total**2).sum() - own) / (count * (count - 1))
    return out
