"""Boxes derived from other boxes: panes merged over their bars, or grown over their frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.kernels import njit
from cityflow.windows.box_edges import Edges, strength
from cityflow.windows.candidates import ALIGN_M, Candidates, measured, sized
from cityflow.windows.facade_picture import Picture
from cityflow.windows.window_parameters import WindowParameters

MULLION_M, MULLION_PX = 0.3, 4.0
"""What parts two panes of one window is no wider, and no wider in pixels where pictures are coarse; set by hand."""
MULLIONED_M = 1.9
"""Widest bar: metres; where pixels are coarse, pixels, in windows of at most `MULLIONED_M`; set by hand on drawn façades, as is the next."""
LAP_PX = 2
"""Cells by which boxes on both sides of a bar may overlap: each ends at the farther edge of it."""
FRAME_M = 0.2
"""Widest frame of a window; set by hand on drawn façades."""
WHOLE = 0.7
"""Completeness of the worst side from which a box is whole."""


def fused(found: Candidates, picture: Picture, channels: Sequence[Edges], parameters: WindowParameters) -> Candidates:
    """Pairs of boxes with a bar between them, side by side and equally high or one above the other and equally wide, as one box each."""
    tolerance = max(picture.pixels(ALIGN_M) / 2, 1.5)
    parts = [found.of(np.zeros(0, np.int64))]
    for channel in range(len(channels)):
        boxes = found.boxes[(found.channel == channel) & (found.sides.min(axis=1) >= 0.4)]
        for axis in (0, 1):
            ends = boxes[:, [1 - axis, 3 - axis]]
            level = (np.abs(ends[:, None] - ends[None]) <= tolerance).all(axis=2)
            first = boxes[:, axis] + boxes[:, axis + 2]
            one, other = np.nonzero(
                level & (first[:, None] < first[None]) & (boxes[:, None, axis + 2] - boxes[None, :, axis] <= LAP_PX)
            )
            gap = boxes[other, axis] - boxes[one, axis + 2]
            size = np.minimum(*(boxes[k, axis + 2] - boxes[k, axis] for k in (one, other)))
            whole = boxes[other, axis + 2] - boxes[one, axis]
            near = (gap <= picture.pixels(MULLION_M)) | ((gap <= MULLION_PX) & (whole <= picture.pixels(MULLIONED_M)))
            near &= gap <= 0.75 * size
            both = np.concatenate(
                [np.minimum(boxes[one, :2], boxes[other, :2]), np.maximum(boxes[one, 2:], boxes[other, 2:])], axis=1
            )[near]
            made = measured(picture, channels, channel, np.unique(both, axis=0))
            parts.append(made.of(sized(made.boxes, picture, parameters) & (made.sides.min(axis=1) >= 0.5)))
    return Candidates.joined(parts)


def hold_panes(boxes: IntArray, panes: IntArray, picture: Picture) -> BoolArray:
    """(N,) whether a box contains one of the merged panes, at most a frame wider and at most three times as high: then the pane is a part of it."""
    return np.asarray(_hold(boxes, panes, float(picture.pixels(FRAME_M) + 1)))


@njit(cache=True, nogil=True)
def _hold(boxes: IntArray, panes: IntArray, frame: float) -> BoolArray:
    found = np.zeros(len(boxes), np.bool_)
    for n in range(len(boxes)):
        left, top, right, bottom = boxes[n]
        for k in range(len(panes)):
            before, after = left - panes[k, 0], right - panes[k, 2]
            if -frame <= before <= 1 and -1 <= after <= frame and top - panes[k, 1] <= 1 and bottom - panes[k, 3] >= -1:
                taller = (bottom - top) / max(panes[k, 3] - panes[k, 1], 1)
                if 1.1 < taller <= 3:
                    found[n] = True
                    break
    return found


def framed(found: Candidates, picture: Picture, channels: Sequence[Edges], parameters: WindowParameters) -> Candidates:
    """Boxes grown over a frame of the other sign, where one follows on all sides; measured by its outer edges."""
    reach = np.arange(1, max(round(picture.pixels(FRAME_M)), 2) + 1)
    parts = [found.of(np.zeros(0, np.int64))]
    for channel in range(len(channels)):
        boxes = np.unique(found.boxes[(found.channel == channel) & (found.sides.min(axis=1) >= 0.5)], axis=0)
        if len(boxes) == 0:
            continue
        grown, steps = boxes.copy(), np.empty((len(boxes), 4))
        rows, cols = picture.light.shape
        most = (0, 0, cols, rows)
        for side, way in enumerate((-1, -1, 1, 1)):
            tried = np.repeat(boxes[:, None], len(reach), axis=1)
            tried[:, :, side] = np.clip(
                tried[:, :, side] + way * reach, 0, max(most[side], cols + rows if side < 2 else 0)
            )
            tried[:, :, side] = np.minimum(tried[:, :, side], (cols, rows)[side % 2])
            values = strength(channels[channel ^ 1], tried.reshape(-1, 4))[:, side].reshape(len(boxes), -1)
            best = values.argmax(axis=1)
            grown[:, side], steps[:, side] = (
                tried[np.arange(len(boxes)), best, side],
                values[np.arange(len(boxes)), best],
            )
        made = measured(picture, channels, channel ^ 1, grown[(steps >= 0.8).all(axis=1)])
        made = replace(made, contrast=made.steps.mean(axis=1))
        parts.append(made.of(sized(made.boxes, picture, parameters) & (made.sides.min(axis=1) >= 0.4)))
    return Candidates.joined(parts)
