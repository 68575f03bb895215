"""One resampling from the original pixels into a raster window of a rectified pair."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray
from cityflow.core.kernels import njit
from cityflow.matching.grey import GreyImage

NODE_PX = 8
"""Mapping is exact at nodes this far apart and bilinear between: the error stays below 0.01 px for cameras of 4,000 px focal length."""
FILL = 128
"""Grey of what no image sees: the middle of the scale; no disparity comes from there."""

NOWHERE = -1e6
"""Row and column of what no image sees."""

PixelMap = Callable[[FloatArray, FloatArray], FloatArray]


def resampled(
    image: GreyImage, source: PixelMap, top_left: tuple[int, int], shape: tuple[int, int], level: int
) -> tuple[ByteArray, BoolArray | None]:
    """(rows, cols) uint8 of a window of the rectified lattice, and which of its pixels the image shows (None: all).

    Parameters
    ----------
    source : rectified x and y of level 0 → image coordinates of level 0, NaN where there are none
    top_left : row and column of the window in lattice pixels of `level`
    """
    at_row, at_col, nodes = _source_grid(source, top_left, shape, level)
    rows, cols = image.shape(level)
    rows_used, cols_used = _used(nodes[0], rows), _used(nodes[1], cols)
    if rows_used[0] >= rows_used[1] or cols_used[0] >= cols_used[1]:
        return np.full(shape, FILL, np.uint8), np.zeros(shape, bool)
    inside = None
    if nodes.min() < 0 or nodes[0].max() > rows - 1 or nodes[1].max() > cols - 1:
        inside = _inside(at_row, at_col, rows, cols)
    window = image.window(rows_used, cols_used, level)
    at_row -= np.float32(rows_used[0])
    at_col -= np.float32(cols_used[0])
    out = cv2.remap(window, at_col, at_row, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    if inside is not None:
        out[~inside] = FILL
    return np.asarray(out), inside


def _source_grid(
    source: PixelMap, top_left: tuple[int, int], shape: tuple[int, int], level: int
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Row and column, counted from pixel centres, that each lattice pixel comes from, -1e6 where from nowhere; and (2, …) those of the nodes."""
    step = float(1 << level)
    down, right = (-(-n // NODE_PX) + 2 for n in shape)
    # resize() takes nodes for centres of cells of NODE_PX pixels
    y = (top_left[0] + (np.arange(down) - 0.5) * NODE_PX) * step
    x = (top_left[1] + (np.arange(right) - 0.5) * NODE_PX) * step
    uv = source(*np.meshgrid(x, y)) / step - 0.5
    nodes = np.ascontiguousarray(np.nan_to_num(uv, nan=NOWHERE).astype(np.float32).transpose(2, 0, 1)[::-1])
    size = (right * NODE_PX, down * NODE_PX)
    part = np.s_[NODE_PX : NODE_PX + shape[0], NODE_PX : NODE_PX + shape[1]]
    at_row, at_col = (np.asarray(cv2.resize(n, size, interpolation=cv2.INTER_LINEAR)[part]) for n in nodes)
    return np.ascontiguousarray(at_row), np.ascontiguousarray(at_col), nodes


def _used(nodes: Float32Array, size: int) -> tuple[int, int]:
    """Pixels that a bicubic interpolation between these positions reads."""
    known = nodes[nodes > NOWHERE / 2]
    if not len(known):
        return 0, 0
    return max(int(np.floor(known.min())) - 2, 0), min(int(np.ceil(known.max())) + 3, size)


@njit(cache=True, nogil=True)
def _inside(at_row, at_col, rows, cols):  # type: ignore[no-untyped-def]
    """Which positions an image of this size shows."""
    out = np.empty(at_row.shape, np.bool_)
    half, bottom, right = np.float32(-0.5), np.float32(rows - 0.5), np.float32(cols - 0.5)
    for i in range(at_row.shape[0]):
        row, col, own = at_row[i], at_col[i], out[i]
        for j in range(row.size):
            own[j] = (row[j] >= half) & (row[j] <= bottom) & (col[j] >= half) & (col[j] <= right)
    return out
