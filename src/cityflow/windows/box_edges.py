"""Completeness of the four sides of boxes, and contrast of boxes with their surroundings, for many boxes at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.windows.facade_picture import Picture
from cityflow.windows.window_parameters import WindowParameters

DARK, BRIGHT = -1, 1
"""Sign of a window's brightness less that of its wall."""


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Differences across the boundaries of cells.

    Attributes
    ----------
    light : (rows, cols) float32, brightness with thin bars taken out
    across, along : (rows, cols + 1) and (rows + 1, cols) float32: brightness right of a boundary less that left of it; below less above
    sign : `DARK` or `BRIGHT`
    threshold : difference that counts as an edge
    width : cells on either side that were averaged
    """

    light: Float32Array
    across: Float32Array
    along: Float32Array
    sign: int
    threshold: float
    width: int
    _sums: tuple[Float32Array, ...]
    _seen: Float32Array
    _light: Float32Array
    _squares: Float32Array
    _strength: tuple[Float32Array, Float32Array]


def edges_of(picture: Picture, values: Float32Array, sign: int, parameters: WindowParameters) -> Edges:
    """Edges that windows of one sign (`DARK`, `BRIGHT`) can have in the picture's brightness or hue (`values`)."""
    light = without_bars(picture, values, sign, parameters)
    width = 2 if picture.cell < 0.1 else 1
    across, along = _steps(light, width), _steps(np.ascontiguousarray(light.T), width).T
    seen = picture.seen
    quiet = np.concatenate([np.abs(across[:, 1:])[seen], np.abs(along[1:])[seen]])
    scatter = 1.48 * float(np.median(quiet)) if len(quiet) else 1.0
    threshold = max(parameters.edge_sigmas * scatter, 0.5 * parameters.least_contrast)
    sums = tuple(
        np.cumsum(np.pad(_near(sign * way * steps > threshold, axis), ((1, 0), (0, 0)) if axis == 1 else ((0, 0), (1, 0))), axis=1 - axis, dtype=np.float32)
        for steps, axis in ((across, 1), (along, 0)) for way in (1, -1)
    )  # fmt: skip
    strength = (
        np.cumsum(np.pad(sign * across, ((1, 0), (0, 0))), axis=0, dtype=np.float64).astype(np.float32),
        np.cumsum(np.pad(sign * along, ((0, 0), (1, 0))), axis=1, dtype=np.float64).astype(np.float32),
    )
    return Edges(
        light, across, along, sign, threshold, width, sums, integral(seen.astype(np.float32)), integral(light), integral(light**2), strength
    )  # fmt: skip


def without_bars(picture: Picture, values: Float32Array, sign: int, parameters: WindowParameters) -> Float32Array:
    """Brightness without thin bright things within dark windows, or thin dark ones within bright windows."""
    light: Float32Array = np.asarray(cv2.medianBlur(values, 3), np.float32)
    size = round(picture.pixels(parameters.bars_m))
    if size < 1:
        return light
    return np.asarray(_opened(light, size + 1) if sign == DARK else -_opened(-light, size + 1))


def _opened(light: Float32Array, size: int) -> Float32Array:
    """Grey-value opening by a square; its two halves have mirrored anchors, else squares of even size would shift the picture by a cell."""
    kernel, edge = np.ones((size, size), np.uint8), cv2.BORDER_REPLICATE
    first, second = size // 2, size - 1 - size // 2
    low = cv2.erode(light, kernel, anchor=(first, first), borderType=edge)
    return np.asarray(cv2.dilate(low, kernel, anchor=(second, second), borderType=edge))


def completeness(edges: Edges, boxes: IntArray) -> FloatArray:
    """(N, 4) share of the left, top, right and bottom side of boxes (N, 4: left, top, right, bottom) with a step of brightness of the right sign."""
    left, top, right, bottom = boxes.T
    rise, fall, rise_down, fall_down = edges._sums
    high, wide = np.maximum(bottom - top, 1), np.maximum(right - left, 1)
    return np.stack(
        [
            (rise[bottom, left] - rise[top, left]) / high, (rise_down[top, right] - rise_down[top, left]) / wide,
            (fall[bottom, right] - fall[top, right]) / high, (fall_down[bottom, right] - fall_down[bottom, left]) / wide,
        ],
        axis=1,
    )  # fmt: skip


def refined(edges: Edges, boxes: IntArray, reach: int) -> IntArray:
    """Boxes whose sides have moved by up to `reach` cells to where brightness steps most."""
    out = boxes.copy()
    moves = np.arange(-reach, reach + 1)
    down, right = edges._strength
    for side, way in ((0, 1), (2, -1)):
        at = np.clip(boxes[:, side, None] + moves, 0, down.shape[1] - 1)
        steps = way * (down[boxes[:, 3, None], at] - down[boxes[:, 1, None], at])
        out[:, side] = at[np.arange(len(at)), np.argmax(steps - 1e-4 * np.abs(moves), axis=1)]
    for side, way in ((1, 1), (3, -1)):
        at = np.clip(boxes[:, side, None] + moves, 0, right.shape[0] - 1)
        steps = way * (right[at, boxes[:, 2, None]] - right[at, boxes[:, 0, None]])
        out[:, side] = at[np.arange(len(at)), np.argmax(steps - 1e-4 * np.abs(moves), axis=1)]
    return out


def strength(edges: Edges, boxes: IntArray) -> FloatArray:
    """(N, 4) mean step across each side, in the direction that a window has, in thresholds."""
    left, top, right, bottom = boxes.T
    down, along = edges._strength
    high, wide = np.maximum(bottom - top, 1), np.maximum(right - left, 1)
    steps = np.stack(
        [
            (down[bottom, left] - down[top, left]) / high, (along[top, right] - along[top, left]) / wide,
            (down[top, right] - down[bottom, right]) / high, (along[bottom, left] - along[bottom, right]) / wide,
        ],
        axis=1,
    )  # fmt: skip
    return np.asarray(steps / edges.threshold, np.float64)


def contrast(edges: Edges, boxes: IntArray, rim: int) -> FloatArray:
    """(N,) how much boxes are brighter (`BRIGHT`) or darker (`DARK`) than a rim around them, in thresholds."""
    inner = box_sums(edges._light, boxes)
    wide = boxes + rim * np.array([-1, -1, 1, 1])
    rows, cols = edges.light.shape
    cut = np.clip(wide, 0, [cols, rows, cols, rows])
    area, area_wide = box_areas(boxes), box_areas(cut)
    around = (box_sums(edges._light, cut) - inner) / np.maximum(area_wide - area, 1)
    return np.asarray(edges.sign * (inner / np.maximum(area, 1) - around) / edges.threshold)


def roughness(channels: Sequence[Edges], channel: IntArray, boxes: IntArray, rim: int) -> tuple[FloatArray, FloatArray]:
    """(N,) and (N,) standard deviations in a rim around boxes and within them, each in its own channel, in thresholds."""
    around, inside = np.zeros(len(boxes)), np.zeros(len(boxes))
    for k, edges in enumerate(channels):
        of = channel == k
        rows, cols = edges.light.shape
        outer = np.clip(boxes[of] + (rim + 1) * np.array([-1, -1, 1, 1]), 0, [cols, rows, cols, rows])
        guard = np.clip(boxes[of] + np.array([-1, -1, 1, 1]), 0, [cols, rows, cols, rows])
        core = boxes[of] + np.array([1, 1, -1, -1])
        around[of] = _deviation(_moments(edges, outer) - _moments(edges, guard)) / edges.threshold
        inside[of] = _deviation(_moments(edges, core)) / edges.threshold
    return around, inside


def _moments(edges: Edges, boxes: IntArray) -> FloatArray:
    """(3, N) number of cells, sum and sum of squares."""
    area = box_areas(boxes).astype(np.float64)
    return np.stack([area, box_sums(edges._light, boxes), box_sums(edges._squares, boxes)])


def _deviation(moments: FloatArray) -> FloatArray:
    n, total, squares = moments
    n = np.maximum(n, 1)
    return np.asarray(np.sqrt(np.maximum(squares / n - (total / n) ** 2, 0)))


def seen_share(edges: Edges, boxes: IntArray) -> FloatArray:
    """(N,) share of boxes with true texture; they may reach beyond the picture."""
    return box_sums(edges._seen, boxes) / np.maximum(box_areas(boxes), 1)


def box_areas(boxes: IntArray) -> IntArray:
    """(N,) cells; negative where one end alone is turned round."""
    size: IntArray = boxes[:, 2:] - boxes[:, :2]
    return size[:, 0] * size[:, 1]


@njit(cache=True, nogil=True)
def box_sums(integral: Float32Array, boxes: IntArray) -> FloatArray:
    """(N,) sums over boxes, cut off at the picture's edges."""
    rows, cols = integral.shape[0] - 1, integral.shape[1] - 1
    sums = np.empty(len(boxes))
    for n in range(len(boxes)):
        x_0, x_1 = min(max(boxes[n, 0], 0), cols), min(max(boxes[n, 2], 0), cols)
        y_0, y_1 = min(max(boxes[n, 1], 0), rows), min(max(boxes[n, 3], 0), rows)
        sums[n] = integral[y_1, x_1] - integral[y_0, x_1] - integral[y_1, x_0] + integral[y_0, x_0]
    return sums


def _steps(light: Float32Array, width: int) -> Float32Array:
    """(rows, cols + 1) mean of `width` cells right of a boundary less that of those left of it; 0 at the picture's edges."""
    cols = light.shape[1]
    sums = np.cumsum(np.pad(light, ((0, 0), (width + 1, width)), mode="edge"), axis=1, dtype=np.float64)
    at = np.arange(cols + 1) + width
    steps = (sums[:, at + width] - 2 * sums[:, at] + sums[:, at - width]) / width
    return np.asarray(steps, np.float32)


def _near(marks: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], axis: int) -> Float32Array:
    """Marks, and the boundaries next to them on both sides, as 0 and 1."""
    kernel = np.ones((1, 3) if axis == 1 else (3, 1), np.uint8)
    return np.asarray(cv2.dilate(marks.astype(np.uint8), kernel), np.float32)


def integral(raster: Float32Array) -> Float32Array:
    """(rows + 1, cols + 1) sums of all cells above and left of a corner."""
    return np.asarray(cv2.integral(raster, sdepth=cv2.CV_64F))
