"""One resampling from the original pixels into a raster window of a rectified pair."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.matching.grey import GreyImage

NODE_PX = 8
"""Mapping is exact at nodes this far apart and bilinear between: the error stays below 0.01 px for cameras of 4,000 px focal length."""
FILL = 128
"""Grey of what no image sees: the middle of the scale; no disparity comes from there."""

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
    at_row, at_col = _source_grid(source, top_left, shape, level)
    rows, cols = image.shape(level)
    inside = None
    ends = np.array([at_row.min(), rows - 1 - at_row.max(), at_col.min(), cols - 1 - at_col.max()])
    if not bool(np.all(ends >= 0)):
        inside = (at_row >= -0.5) & (at_row <= rows - 0.5) & (at_col >= -0.5) & (at_col <= cols - 0.5)
        if not inside.any():
            return np.full(shape, FILL, np.uint8), inside
        rows_used, cols_used = _range(at_row[inside], rows), _range(at_col[inside], cols)
    else:
        rows_used, cols_used = _range(at_row, rows), _range(at_col, cols)
    window = image.window(rows_used, cols_used, level)
    at_row -= np.float32(rows_used[0])
    at_col -= np.float32(cols_used[0])
    out = cv2.remap(window, at_col, at_row, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    if inside is not None:
        out[~inside] = FILL
    return np.asarray(out), inside


def _source_grid(
    source: PixelMap, top_left: tuple[int, int], shape: tuple[int, int], level: int
) -> tuple[FloatArray, FloatArray]:
    """Row and column, counted from pixel centres, that each lattice pixel comes from; float32, -1e6 where from nowhere."""
    step = float(1 << level)
    down, right = (-(-n // NODE_PX) + 2 for n in shape)
    # resize() takes nodes for centres of cells of NODE_PX pixels
    y = (top_left[0] + (np.arange(down) - 0.5) * NODE_PX) * step
    x = (top_left[1] + (np.arange(right) - 0.5) * NODE_PX) * step
    uv = source(*np.meshgrid(x, y)) / step - 0.5
    uv = np.nan_to_num(uv, nan=-1e6).astype(np.float32)
    size = (right * NODE_PX, down * NODE_PX)
    part = np.s_[NODE_PX : NODE_PX + shape[0], NODE_PX : NODE_PX + shape[1]]
    at_col, at_row = (
        cv2.resize(np.ascontiguousarray(uv[..., i]), size, interpolation=cv2.INTER_LINEAR)[part] for i in (0, 1)
    )
    return np.ascontiguousarray(at_row), np.ascontiguousarray(at_col)


def _range(at: FloatArray, size: int) -> tuple[int, int]:
    """Pixels that a bicubic interpolation at these positions reads."""
    return max(int(np.floor(at.min())) - 2, 0), min(int(np.ceil(at.max())) + 3, size)
