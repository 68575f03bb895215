"""Segments that may be windows: connected areas below or above each of many brightness thresholds, of a window's size and shape."""

from __future__ import annotations

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, IntArray
from cityflow.windows.box_edges import DARK, Edges
from cityflow.windows.facade_picture import Picture
from cityflow.windows.window_parameters import WindowParameters

LEAST_PX = 3.0
"""Pixels across the shortest side; coarser textures show no window; set by hand on drawn façades."""
LEVELS = 48
"""Brightnesses at which façades are cut into segments; set by hand on drawn façades."""

LEAST_FILL = 0.6
"""Least share of its box that a segment covers; curtains and reflections reduce it; set by hand on drawn façades."""


def segments(picture: Picture, edges: Edges, sign: int, parameters: WindowParameters) -> IntArray:
    """(N, 4) boxes of segments (left, top, right, bottom), each once.

    A window is a segment by itself at some brightness between its own and that of its wall, also where the wall is partly in the shade.
    """
    found = [
        _boxes(_cut(edges.light, picture, level, sign), picture, parameters) for level in _levels(edges.light, picture)
    ]
    boxes = np.concatenate([np.empty((0, 4), np.int64), *found])
    return np.asarray(np.unique(boxes, axis=0))


def _levels(light: Float32Array, picture: Picture) -> list[float]:
    if not picture.seen.any():
        return []
    low, high = np.quantile(light[picture.seen], [0.002, 0.998])
    return [float(v) for v in np.linspace(low, high, LEVELS + 2)[1:-1]]


def _cut(
    light: Float32Array, picture: Picture, level: float, sign: int
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    marks = (light < level) if sign == DARK else (light > level)
    return (marks & picture.wall).astype(np.uint8)


def _boxes(
    marks: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], picture: Picture, parameters: WindowParameters
) -> IntArray:
    _, _, stats, _ = cv2.connectedComponentsWithStats(marks, connectivity=4, ltype=cv2.CV_32S)
    _, _, wide, high, area = stats.T
    shortest, longest = np.minimum(wide, high), np.maximum(wide, high)
    least = max(picture.pixels(parameters.least_m), LEAST_PX)
    good = (shortest >= least - 1) & (longest <= picture.pixels(parameters.most_m) + 1)
    good &= (longest <= parameters.most_aspect * (shortest + 1)) & (area >= LEAST_FILL * wide * high)
    good[0] = False  # what is none
    boxes = stats[good, :4].astype(np.int64)
    boxes[:, 2:] += boxes[:, :2]
    return boxes
