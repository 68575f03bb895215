"""Where images disagree about what stands at the height of a roof: there is none, though the surface has one.

Matching bridges a gap of a metre between two blocks at the height of their roofs. Images resampled onto that bridge show a wall from one side, another
from the other, the ground from above and shade along it. On a true roof all show the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Grid
from cityflow.core.kernels import njit
from cityflow.core.pixels import LUMA, level_shape

CELL_M = 0.25
"""Cells in which images are compared: a narrow gap has two or more."""
LEAST_IMAGES = 4
"""Fewer say nothing; set by hand, as are those below."""
AROUND_M = 1.0
"""A step of the surface is rounded off: either of its heights counts so far beside it."""
DEEPEST_M = 6.0
"""A step's foot lies at most so far below its head."""
OFF_M = (0.0, -0.4, 0.3)
"""Heights that are tried, off the surface: it is that wrong on roofs."""
BALANCE_M = 3.75
"""Side of the square whose mean brightness is made the same in all images."""
DARK = 12.0
"""Of 255, added to all brightness: what noise and haze add to shade."""
STEP_M, REACH_M, UNDER_M = 0.5, 9.0, 0.4
"""Steps and length of a ray back to an image, in plan; how far it may run below the surface."""
MARGIN_PX = 3
WHITE = 255.0


@dataclass(frozen=True, slots=True)
class RoofCells:
    """Cells of roofs whose images are compared.

    Attributes
    ----------
    grid : cells of `CELL_M`, `REACH_M` beyond the roofs
    heights : (rows, cols) float32, metres; NaN where unknown
    row, col : (N,) cells of roofs with a height
    """

    grid: Grid
    heights: Float32Array
    row: IntArray
    col: IntArray

    def raster(self, values: Float32Array) -> Float32Array:
        """(..., rows, cols) of (..., N) values of the roofs; NaN elsewhere."""
        out = np.full((*values.shape[:-1], *self.grid.shape), np.nan, np.float32)
        out[..., self.row, self.col] = values
        return out


@dataclass(frozen=True, slots=True)
class Shown:
    """What images show on roofs, at the height near the surface at which they agree best.

    Attributes
    ----------
    spread : (N,) standard deviation of their log brightness; NaN where fewer than `LEAST_IMAGES` see it
    values : (images, N) log brightness of each, its mean around taken off; NaN where it does not see it
    """

    spread: Float32Array
    values: Float32Array


def shown_on(cells: RoofCells, images: Sequence[ColourImage]) -> Shown:
    """What those of the images show that have any of the roofs in their frame."""
    surface, heights = _tried(cells.heights)
    x, y = (a[cells.row, cells.col] for a in cells.grid.centres())
    at = np.array([h[cells.row, cells.col] for h in heights], np.float64)
    sums, seeing = np.zeros((3, *at.shape)), []
    for image in images:
        values = _values(image, x, y, at, surface, cells)
        if values is None:
            continue
        seeing.append(image)
        known = np.isfinite(values)
        values = np.where(known, values, 0.0)
        sums += known, values, values**2
    spread, best = _least_spread(sums)
    chosen = np.take_along_axis(at, best[None], axis=0)
    shown = [_values(image, x, y, chosen, surface, cells) for image in seeing]
    none = np.empty((0, len(x)), np.float32)
    return Shown(spread, np.concatenate([none, *(v.astype(np.float32) for v in shown if v is not None)]))


def _tried(heights: Float32Array) -> tuple[Float32Array, list[Float32Array]]:
    """The surface without holes and lone cells, and the heights that are tried of each cell."""
    known = np.isfinite(heights)
    lowest = heights[known].min() if known.any() else np.float32(0.0)
    smooth = np.asarray(cv2.medianBlur(np.where(known, heights, lowest).astype(np.float32), 3), np.float32)
    kernel = np.ones((2 * round(AROUND_M / CELL_M) + 1,) * 2, np.uint8)
    high = np.asarray(cv2.dilate(smooth, kernel), np.float32)
    low = np.maximum(np.asarray(cv2.erode(smooth, kernel), np.float32), high - np.float32(DEEPEST_M))
    return smooth, [*(smooth + np.float32(off) for off in OFF_M), high, low]


def _values(
    colour: ColourImage, x: FloatArray, y: FloatArray, z: FloatArray, surface: Float32Array, cells: RoofCells
) -> FloatArray | None:
    """(H, N) log brightness at (H, N) heights, the mean around at the first taken off; NaN where it does not see it, None where it sees nothing."""
    xyz = np.stack([np.broadcast_to(x, z.shape), np.broadcast_to(y, z.shape), z], axis=-1)
    uv, depth = colour.image.project(xyz.reshape(-1, 3))
    held = colour.image.holds(uv, MARGIN_PX) & (depth > 0.0)
    if not held[: len(x)].any():
        return None
    to = colour.image.centre - xyz[0].mean(axis=0)
    pixel_m = float(np.linalg.norm(to)) / colour.image.camera.fx
    level = max(0, math.floor(math.log2(CELL_M / 2.0 / pixel_m)))
    uv /= 1 << level
    tall, wide = level_shape(colour.pixels.height, colour.pixels.width, level)
    first = np.floor(uv[held].min(axis=0)).astype(int) - 1
    after = np.ceil(uv[held].max(axis=0)).astype(int) + 1
    rows = max(int(first[1]), 0), min(int(after[1]), tall)
    cols = max(int(first[0]), 0), min(int(after[0]), wide)
    ray = to / max(float(np.hypot(to[0], to[1])), 1e-9)
    grey, uv = _log_brightness(colour, rows, cols, level), uv.reshape(*z.shape, 2) - (cols[0] + 0.5, rows[0] + 0.5)
    z = np.where(held.reshape(z.shape), z, np.nan)
    values = _looked_up(grey, uv, z, surface, cells.row, cells.col, ray, STEP_M / CELL_M)
    return np.asarray(values - _around(values[0], cells))


def _log_brightness(colour: ColourImage, rows: tuple[int, int], cols: tuple[int, int], level: int) -> Float32Array:
    """(rows, cols) of a window of a level."""
    window = np.asarray(colour.pixels.window(rows, cols, level), np.float32)
    parts = LUMA if window.shape[2] >= len(LUMA) else (1.0,)
    grey = np.zeros(window.shape[:2], np.float32)
    for k, part in enumerate(parts):
        grey += np.float32(part) * window[..., k]
    white = colour.white or float(np.iinfo(colour.pixels.dtype).max)
    return np.ascontiguousarray(np.log(grey * np.float32(WHITE / white) + np.float32(DARK)), np.float32)


@njit(cache=True, nogil=True)
def _looked_up(grey, uv, z, surface, rows, cols, ray, step):  # type: ignore[no-untyped-def]
    """(H, N) values of an image at (H, N, 2) pixels; NaN where `z` is, outside of the image, and behind the surface.

    `ray` points to the image, of length 1 in plan; `step` along it in cells.
    """
    tall, wide = grey.shape
    out = np.full(z.shape, np.nan)
    for h in range(z.shape[0]):
        for i in range(z.shape[1]):
            if np.isnan(z[h, i]):
                continue
            hidden = False
            for k in range(1, int(REACH_M / STEP_M) + 1):
                r, c = int(rows[i] + 0.5 - k * step * ray[1]), int(cols[i] + 0.5 + k * step * ray[0])
                if r < 0 or c < 0 or r >= surface.shape[0] or c >= surface.shape[1]:
                    break
                if surface[r, c] > z[h, i] + k * STEP_M * ray[2] + UNDER_M:
                    hidden = True
                    break
            if hidden:
                continue
            u, v = uv[h, i, 0], uv[h, i, 1]
            c, r = min(max(int(np.floor(u)), 0), wide - 2), min(max(int(np.floor(v)), 0), tall - 2)
            a, b = u - c, v - r
            upper = grey[r, c] * (1.0 - a) + grey[r, c + 1] * a
            out[h, i] = upper * (1.0 - b) + (grey[r + 1, c] * (1.0 - a) + grey[r + 1, c + 1] * a) * b
    return out


def _around(values: FloatArray, cells: RoofCells) -> FloatArray:
    """(N,) mean of an image's values around each cell."""
    known = np.isfinite(values)
    at = cells.row[known], cells.col[known]
    sums = np.zeros((2, *cells.grid.shape))
    sums[0][at], sums[1][at] = values[known], 1.0
    size = (2 * round(BALANCE_M / CELL_M / 2) + 1,) * 2
    total, count = (cv2.boxFilter(a, -1, size, normalize=False, borderType=cv2.BORDER_CONSTANT) for a in sums)
    return np.asarray(total[cells.row, cells.col] / np.maximum(count[cells.row, cells.col], 1.0))


def _least_spread(sums: FloatArray) -> tuple[Float32Array, IntArray]:
    """(N,) least spread of (3, H, N) counts, sums and sums of squares; at which height."""
    count, total, squares = sums
    variance = np.maximum(squares - total**2 / np.maximum(count, 1.0), 0.0) / np.maximum(count - 1.0, 1.0)
    spread = np.where(count >= LEAST_IMAGES, np.sqrt(variance), np.inf)
    best = np.asarray(spread.argmin(axis=0), np.int64)
    least = np.take_along_axis(spread, best[None], axis=0)[0]
    return np.where(np.isfinite(least), least, np.nan).astype(np.float32), best
