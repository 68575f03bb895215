"""One resampling from the original pixels into a raster window of a rectified pair."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.core.kernels import njit
from cityflow.matching.cubic import EIGHT, cubic
from cityflow.matching.grey import GreyImage

NODE_PX = 8
"""Mapping is exact at nodes this far apart and bilinear between: the error stays below 0.01 px for cameras of 4,000 px focal length."""
FILL = 128
"""Grey of what no image sees: the middle of the scale; no disparity comes from there."""

AFTER = 3
"""Pixels from the one that a place lies behind that are read, with it."""
BORDER_PX = 4
"""Pixels that a window is widened by, as its edge is: more than a place on the edge reads."""
NOWHERE = -1e6
"""Row and column of what no image sees."""
FARTHEST = 1e30
"""Places farther away, not numbers among them, are nowhere: between infinite ones there would be no number, and no pixel."""

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
    nodes = _source_nodes(source, top_left, shape, level)
    rows, cols = image.shape(level)
    rows_used, cols_used = _used(nodes[0], rows), _used(nodes[1], cols)
    if rows_used[0] >= rows_used[1] or cols_used[0] >= cols_used[1]:
        return np.full(shape, FILL, np.uint8), np.zeros(shape, bool)
    inside = np.empty((0, 0), np.bool_)
    if nodes.min() < 0 or nodes[0].max() > rows - 1 or nodes[1].max() > cols - 1:
        inside = np.empty(shape, np.bool_)
    first = rows_used[0], cols_used[0]
    window = cv2.copyMakeBorder(image.window(rows_used, cols_used, level), *(BORDER_PX,) * 4, cv2.BORDER_REPLICATE)
    nodes = (nodes - np.reshape(first, (2, 1, 1))).astype(np.float32)
    out = _drawn(
        np.asarray(window, np.uint8), nodes, shape, (-first[0], -first[1], rows - first[0], cols - first[1]), inside
    )
    return np.asarray(out), inside if inside.size else None


def _source_nodes(source: PixelMap, top_left: tuple[int, int], shape: tuple[int, int], level: int) -> FloatArray:
    """(2, down, right) rows and columns, counted from pixel centres, that nodes of the lattice come from, `NOWHERE` where from nowhere.

    The first node stands half of `NODE_PX` before the window.
    """
    step = float(1 << level)
    down, right = (-(-n // NODE_PX) + 2 for n in shape)
    y = (top_left[0] + (np.arange(down) - 0.5) * NODE_PX) * step
    x = (top_left[1] + (np.arange(right) - 0.5) * NODE_PX) * step
    uv = source(*np.meshgrid(x, y)) / step - 0.5
    return np.ascontiguousarray(np.where(np.abs(uv) < FARTHEST, uv, NOWHERE).transpose(2, 0, 1)[::-1])


def _used(nodes: FloatArray, size: int) -> tuple[int, int]:
    """Pixels that a bicubic interpolation between these positions reads."""
    known = nodes[nodes > NOWHERE / 2]
    if not len(known):
        return 0, 0
    return max(int(np.floor(known.min())) - 2, 0), min(int(np.ceil(known.max())) + 3, size)


@njit(cache=True, nogil=True, error_model="numpy")
def _drawn(window, nodes, shape, limits, inside):  # type: ignore[no-untyped-def]
    """(rows, cols) uint8 of `shape`; `inside` is filled where it is of that shape.

    Row by row, so that loops become vector instructions. `window` has `BORDER_PX` pixels more on each side than the one that `nodes` count from; `limits`
    are the first and end row and column of the image there.
    """
    rows, cols = shape
    out = np.empty((rows, cols), np.uint8)
    half, flat, stride = NODE_PX // 2, window.ravel(), np.int32(window.shape[1])
    steps = ((np.arange(NODE_PX) + 0.5) / NODE_PX).astype(np.float32)
    wide = (nodes.shape[2] - 1) * NODE_PX
    at_row, at_col = np.empty(wide, np.float32), np.empty(wide, np.float32)
    across, down, grey = np.empty(wide, np.float32), np.empty(wide, np.float32), np.empty(wide, np.float32)
    place = np.empty(wide, np.int32)
    low = np.float32(1 - BORDER_PX)
    bottom, right = np.float32(window.shape[0] - BORDER_PX - AFTER), np.float32(window.shape[1] - BORDER_PX - AFTER)
    for i in range(rows):
        k, share = (i + half) // NODE_PX, steps[(i + half) % NODE_PX]
        _between(nodes[0, k], nodes[0, k + 1], share, steps, at_row)
        _between(nodes[1, k], nodes[1, k + 1], share, steps, at_col)
        place[:] = 0
        _split(at_row, low, bottom, place, stride, down)
        _split(at_col, low, right, place, np.int32(1), across)
        for j in range(0, wide, EIGHT):
            cubic(flat, stride, place, across, down, grey, j)
        _rounded(grey[half : half + cols], out[i])
        if len(inside):
            _mark(at_row[half : half + cols], at_col[half : half + cols], limits, inside[i])
            _fill(inside[i], out[i])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _between(above, below, share, steps, out):  # type: ignore[no-untyped-def]
    """Linear between nodes: `share` of the way from the row above to the one below, and along them."""
    left = above[0] + share * (below[0] - above[0])
    for k in range(len(above) - 1):
        right = above[k + 1] + share * (below[k + 1] - above[k + 1])
        own, rise = out[k * NODE_PX : (k + 1) * NODE_PX], right - left
        for m in range(NODE_PX):
            own[m] = left + steps[m] * rise
        left = right


@njit(cache=True, nogil=True, error_model="numpy")
def _split(at, low, high, place, step, after):  # type: ignore[no-untyped-def]
    """Add the pixel of the widened window that a coordinate lies behind, times `step`, to `place`; and how far behind it lies.

    Beyond the border all is like its edge.
    """
    more = np.int32(BORDER_PX)
    for j in range(len(at)):
        x = at[j]
        x = low if x < low else x
        x = high if x > high else x
        whole = np.floor(x)
        after[j] = x - whole
        place[j] += np.int32((np.int32(whole) + more) * step)


@njit(cache=True, nogil=True, error_model="numpy")
def _rounded(grey, out):  # type: ignore[no-untyped-def]
    for j in range(len(out)):
        out[j] = np.uint8(min(max(np.rint(grey[j]), np.float32(0)), np.float32(255)))


@njit(cache=True, nogil=True)
def _mark(at_row, at_col, limits, inside):  # type: ignore[no-untyped-def]
    """Which places the image shows."""
    half = np.float32(0.5)
    top, bottom = np.float32(limits[0]) - half, np.float32(limits[2]) - half
    left, right = np.float32(limits[1]) - half, np.float32(limits[3]) - half
    for j in range(len(inside)):
        inside[j] = (at_row[j] >= top) & (at_row[j] <= bottom) & (at_col[j] >= left) & (at_col[j] <= right)


@njit(cache=True, nogil=True)
def _fill(inside, out):  # type: ignore[no-untyped-def]
    for j in range(len(out)):
        shown = np.uint8(255) if inside[j] else np.uint8(0)
        out[j] = (out[j] & shown) | (np.uint8(FILL) & ~shown)
