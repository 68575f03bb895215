"""Completes the height of windows of which only the upper or lower part was found, from other windows of their width."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.windows.box_edges import Edges, completeness
from cityflow.windows.rows import ALIKE

LEAST_WHOLE = 2
"""Number of whole windows that determine the height of the others; set by hand on drawn façades, as are those below."""
LEAST_SIDES = 0.5
"""Completeness of the weaker of both sides of the part that is added."""


def completed_heights(boxes: IntArray, channels: Sequence[Edges], tolerance: float) -> IntArray:
    """Boxes (N, 4) as high as higher ones of their width, downwards or upwards, where the picture shows the sides of what lies between.

    A blind, or what a pane mirrors, may make the half of a window as bright as its wall is; the frame remains.
    """
    out = boxes.copy()
    for end, other in ((3, 1), (1, 3)):
        wanted, asked = _usual_ends(out, end, other, tolerance)
        part = out.copy()
        part[:, end], part[:, other] = wanted, out[:, end]
        part[:, [1, 3]] = np.sort(part[:, [1, 3]], axis=1)
        inside = (part[:, 1] >= 0) & (part[:, 3] <= channels[0].light.shape[0])
        part = np.clip(part, 0, [*channels[0].light.shape[::-1]] * 2)
        sides = np.max([completeness(e, part)[:, [0, 2]].min(axis=1) for e in channels], axis=0)
        out[:, end] = np.where(asked & inside & (sides >= LEAST_SIDES) & _free(part, boxes), wanted, out[:, end])
    return out


def _usual_ends(boxes: IntArray, end: int, other: int, tolerance: float) -> tuple[IntArray, BoolArray]:
    """(N,) where each would end if it were as high as most of the higher ones of its width; and whether there are some."""
    wide, high = boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]
    alike = np.abs(wide[:, None] - wide[None]) <= np.maximum((1 - ALIKE) * wide[:, None], 2)
    higher = alike & (high[None] - high[:, None] > 2 * tolerance)
    usual, asked = high.copy(), np.zeros(len(boxes), bool)
    for k in np.flatnonzero(higher.any(axis=1)):
        heights = high[higher[k]]
        middle = int(np.median(heights))
        asked[k] = np.count_nonzero(np.abs(heights - middle) <= tolerance) >= LEAST_WHOLE
        usual[k] = middle
    return boxes[:, other] + (usual if end == 3 else -usual), asked


def _free(part: IntArray, boxes: IntArray) -> BoolArray:
    """(N,) whether what is added lies upon no other box."""
    low, high = np.maximum(part[:, None, :2], boxes[None, :, :2]), np.minimum(part[:, None, 2:], boxes[None, :, 2:])
    area: FloatArray = np.clip(high - low - 1, 0, None).prod(axis=2).astype(np.float64)
    np.fill_diagonal(area, 0.0)
    return np.asarray(area.max(axis=1, initial=0.0) == 0)
