"""The rectified texture of a façade as input of the search for windows: brightness, mask of true texture, position on the wall's plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.core.pixels import LUMA
from cityflow.core.texture import FIRST_IMAGE, FacePlane, Patch
from cityflow.windows.window_parameters import WindowParameters


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A rectified façade on square cells.

    Attributes
    ----------
    light : (rows, cols) float32 square root of brightness, 0 to 1: noise of photons is the same in light and shade there
    hue : (rows, cols) float32, differences of the square roots of red, green and blue, along the direction in which this wall's colours scatter most
    seen : (rows, cols) bool, inside the wall, with true texture
    wall : (rows, cols) bool, inside the wall
    s_min, t_max : s and t of the outer corner of cell (0, 0), metres;  cell : metres
    gsd_m : what the images really resolve, metres
    """

    light: Float32Array
    hue: Float32Array
    seen: BoolArray
    wall: BoolArray
    s_min: float
    t_max: float
    cell: float
    gsd_m: float

    def pixels(self, metres: float) -> float:
        return metres / self.cell

    def bounds(self, box: FloatArray) -> tuple[float, float, float, float]:
        """s, t of the lower left and the upper right corner of a box of columns and rows (left, top, right, bottom)."""
        left, top, right, bottom = (float(v) for v in box)
        return (
            self.s_min + left * self.cell,
            self.t_max - bottom * self.cell,
            self.s_min + right * self.cell,
            self.t_max - top * self.cell,
        )


def picture_of(face: FacePlane, patch: Patch, parameters: WindowParameters) -> Picture:
    """The rectified patch of a wall, resampled where it is finer than `finest_m`."""
    scale, s_min, t_max = _place(face, patch)
    factor = max(parameters.finest_m / scale, 1.0)
    rows, cols = (max(round(n / factor), 1) for n in patch.mask.shape)
    true = (patch.index >= FIRST_IMAGE).astype(np.float32)
    pixels = patch.pixels.astype(np.float32)
    if factor > 1:
        pixels, true = (_resized(a, rows, cols) for a in (pixels, true))
    cell = scale * patch.mask.shape[1] / cols
    wall = _inside(face, s_min, t_max, (rows, cols), (cell, scale * patch.mask.shape[0] / rows))
    seen = (true > 0.99) & wall
    light = np.sqrt(pixels @ np.array(LUMA, np.float32) / np.float32(255))
    return Picture(light, _hue(pixels, seen), seen, wall, s_min, t_max, cell, max(patch.figures.gsd_m, scale))


def _place(face: FacePlane, patch: Patch) -> tuple[float, float, float]:
    """Size of a pixel, and s, t of the outer corner of the first one, from the corners of the face."""
    st = np.concatenate([face.on_plane(ring) for ring in face.rings])
    at = np.concatenate(patch.corners)[:, :2]
    reach = np.ptp(st, axis=0)
    axis = int(np.argmax(reach))
    cell = float(reach[axis] / np.ptp(at[:, axis]))
    return cell, float(np.mean(st[:, 0] - cell * at[:, 0])), float(np.mean(st[:, 1] + cell * at[:, 1]))


def _resized(raster: Float32Array, rows: int, cols: int) -> Float32Array:
    return np.asarray(cv2.resize(raster, (cols, rows), interpolation=cv2.INTER_AREA), np.float32)


def _inside(
    face: FacePlane, s_min: float, t_max: float, shape: tuple[int, int], cell: tuple[float, float]
) -> BoolArray:
    """Cells whose centre is in the wall: left of them an odd number of its edges crosses the middle of their row."""
    rows, cols = shape
    crossings = np.zeros((rows, cols + 1), np.int32)
    for ring in (face.polygon.exterior, *face.polygon.interiors):
        at = (np.asarray(ring.coords)[:, :2] - (s_min, t_max)) / (cell[0], -cell[1])
        for (x_0, y_0), (x_1, y_1) in pairwise(at.tolist()):
            low, high = sorted((y_0, y_1))
            row = np.arange(max(math.ceil(low - 0.5), 0), min(math.ceil(high - 0.5), rows))
            if len(row):
                x = x_0 + (row + 0.5 - y_0) * (x_1 - x_0) / (y_1 - y_0)
                crossings[row, np.clip(np.ceil(x - 0.5), 0, cols).astype(int)] += 1
    return np.asarray(np.cumsum(crossings[:, :cols], axis=1) % 2 == 1)


def _hue(pixels: Float32Array, seen: BoolArray) -> Float32Array:
    """The colour difference that varies most over what is seen."""
    red, green, blue = np.moveaxis(np.sqrt(pixels / np.float32(255)), -1, 0)
    both = np.stack([red - green, blue - (red + green) / 2], axis=-1)
    if np.count_nonzero(seen) < 2:
        return np.zeros(seen.shape, np.float32)
    values = both[seen].astype(np.float64)
    _, axes = np.linalg.eigh(np.cov(values.T))
    axis = axes[:, 1] * (1 if axes[np.argmax(np.abs(axes[:, 1])), 1] > 0 else -1)
    return np.asarray(both @ axis.astype(np.float32), np.float32)
