"""Probability that a box is a window: a logistic model of 24 features."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.windows.box_edges import Edges, box_areas, box_sums, integral, roughness
from cityflow.windows.candidates import RIM_M, Candidates
from cityflow.windows.facade_picture import Picture

NAMES = (
    "one", "sides", "two worst sides", "worst step", "contrast", "support", "alone", "completed", "rough rim", "rough inside", "aspect", "size",
    "by hue", "pixels across", "support of all", "size against the others", "local deviation", "difference from the wall", "unequal neighbours",
    "weaker line beyond corners", "stronger line beyond corners",
    "below another", "between close boxes", "ends unseen",
)  # fmt: skip
SQUARE_M = 0.7
"""Of wall whose unrest is measured around a candidate; set by hand, as are the next two."""
CLOSE_M, BELOW_M = 0.35, 0.25
"""How near others lie beside it, and below it."""
SMALL_M2 = 10.0
"""Smaller walls have no rows to tell by."""
WEIGHTS = np.array([
    -2.11, 1.35, -0.03, 0.22, 0.96, 0.57, 0.02, -0.86, -0.14, 0.4, -0.31, -5.4,
    0.74, 1.01, 1.85, -1.9, -0.58, 0.36, -0.55, -2.88, -1.11, -2.18, -0.41, -0.78,
])  # fmt: skip
"""Fitted by `benchmarks/windows_facades.py --fit` on drawn façades of other seeds than docs/windows.md judges by; never set by hand."""


def features(
    found: Candidates, support: IntArray, completed: FloatArray, picture: Picture, channels: Sequence[Edges]
) -> FloatArray:
    """(N, 24) in the order of `NAMES`; all about 0 to 3."""
    wide, high = (picture.cell * (found.boxes[:, k + 2] - found.boxes[:, k]) for k in (0, 1))
    rim, inside = roughness(channels, found.channel, found.boxes, max(round(picture.pixels(RIM_M)), 1))
    on = lines_beyond_corners(channels, found)
    usual = [np.median(v) if len(v) else 1.0 for v in (wide, high)]
    return np.column_stack([
        np.ones(len(found)), found.sides.mean(axis=1), np.sort(found.sides, axis=1)[:, :2].mean(axis=1),
        np.clip(found.steps.min(axis=1), -1, 4), np.clip(found.contrast, -1, 6) / 2, np.minimum(support, 4) / 2, support == 0, completed,
        np.clip(rim, 0, 4), np.clip(inside, 0, 4), np.abs(np.log(wide / high)), np.maximum(np.abs(np.log(wide * high / 1.5)) - np.log(3), 0),
        found.channel >= 2,
        np.clip(np.log(np.minimum(wide, high) / picture.cell / 10), -1.2, 1.5), np.full(len(found), np.mean(support > 0) if len(found) else 0.0),
        np.clip(np.abs(np.log(wide / usual[0])) + np.abs(np.log(high / usual[1])), 0, 2), np.full(len(found), local_deviation(picture, channels)),
        difference_from_wall(found.boxes, picture, channels), unequal_neighbours(found.boxes, picture), on.min(axis=1), on.max(axis=1),
        below_another(found.boxes, picture), between_close_boxes(found.boxes, picture), ends_unseen(found.boxes, picture),
    ])  # fmt: skip


def difference_from_wall(boxes: IntArray, picture: Picture, channels: Sequence[Edges]) -> FloatArray:
    """(N,) difference of boxes from the median brightness and hue of the façade, in thresholds; areas between windows, bands or shadows are like the wall."""
    off = np.zeros(len(boxes))
    area = (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)
    wall = _plain_wall(boxes, picture)
    for values, edges in zip((picture.light, picture.hue), channels[::2], strict=False):
        usual = float(np.median(values[wall])) if wall.any() else 0.0
        off = np.maximum(off, np.abs(box_sums(integral(values), boxes) / np.maximum(area, 1) - usual) / edges.threshold)
    return np.clip(off, 0, 6) / 2


def _plain_wall(boxes: IntArray, picture: Picture) -> BoolArray:
    """Cells that the median is taken of: all that are seen; of small walls, as those of dormers, those outside of the boxes."""
    if np.count_nonzero(picture.seen) * picture.cell**2 > SMALL_M2:
        return picture.seen
    out = picture.seen.copy()
    for left, top, right, bottom in boxes.tolist():
        out[max(top, 0) : bottom, max(left, 0) : right] = False
    return out if out.any() else picture.seen


def below_another(boxes: IntArray, picture: Picture) -> FloatArray:
    """(N,) whether a box follows directly below another, as parapets of balconies and their shadows do; windows are a storey apart."""
    gap = boxes[:, None, 1] - boxes[None, :, 3]
    shared = np.minimum(boxes[:, None, 2], boxes[None, :, 2]) - np.maximum(boxes[:, None, 0], boxes[None, :, 0])
    wide = boxes[:, 2] - boxes[:, 0]
    under = (np.abs(gap) <= max(picture.pixels(BELOW_M), 2)) & (shared >= 0.7 * np.minimum(wide[:, None], wide[None]))
    np.fill_diagonal(under, False)
    return under.any(axis=1).astype(np.float64)


def between_close_boxes(boxes: IntArray, picture: Picture) -> FloatArray:
    """(N,) whether close boxes follow on both sides, as with letters."""
    high = boxes[:, 3] - boxes[:, 1]
    level = np.minimum(boxes[:, None, 3], boxes[None, :, 3]) - np.maximum(boxes[:, None, 1], boxes[None, :, 1])
    beside = level >= 0.6 * np.minimum(high[:, None], high[None])
    gap = boxes[None, :, 0] - boxes[:, None, 2]
    near = (gap >= -2) & (gap <= picture.pixels(CLOSE_M))
    right, left = (beside & near).any(axis=1), (beside & near.T).any(axis=1)
    return (left & right).astype(np.float64)


def ends_unseen(boxes: IntArray, picture: Picture) -> FloatArray:
    """(N,) whether a box ends where the true texture ends: its size is then unknown."""
    sums, worst = integral(picture.seen.astype(np.float32)), np.ones(len(boxes))
    for side, way in enumerate((-1, -1, 1, 1)):
        strip = boxes.copy()
        strip[:, (side + 2) % 4], strip[:, side] = boxes[:, side], boxes[:, side] + 2 * way
        worst = np.minimum(worst, box_sums(sums, strip) / np.maximum(np.abs(box_areas(strip)), 1))
    return (worst < 0.7).astype(np.float64)


def unequal_neighbours(boxes: IntArray, picture: Picture) -> FloatArray:
    """(N,) number of close boxes of another width beside each, at most 3, by 1.5: typical of letters."""
    level = np.minimum(boxes[:, None, 3], boxes[None, :, 3]) - np.maximum(boxes[:, None, 1], boxes[None, :, 1])
    gap = np.maximum(boxes[:, None, 0], boxes[None, :, 0]) - np.minimum(boxes[:, None, 2], boxes[None, :, 2])
    high, wide = boxes[:, 3] - boxes[:, 1], (boxes[:, 2] - boxes[:, 0]).astype(np.float64)
    beside = (level >= 0.5 * np.minimum(high[:, None], high[None])) & (gap <= picture.pixels(CLOSE_M)) & (gap > -2)
    unlike = np.minimum(wide[:, None], wide[None]) < 0.75 * np.maximum(wide[:, None], wide[None])
    np.fill_diagonal(beside, False)
    return np.minimum((beside & unlike).sum(axis=1), 3) / 1.5


def lines_beyond_corners(channels: Sequence[Edges], found: Candidates) -> FloatArray:
    """(N, 2) steps on the lines of the upright and of the level sides beyond the corners; lines of panels, panes and beams continue there, those of windows
    end."""
    on = np.zeros((len(found), 2))
    for k, edges in enumerate(channels):
        of = found.channel == k
        for axis in (0, 1):
            on[of, axis] = _beyond_corners(edges, found.boxes[of], axis)
    return np.clip(on, 0, 3)


def _beyond_corners(edges: Edges, boxes: IntArray, axis: int) -> FloatArray:
    """(N,) median of the steps, in thresholds, on the four line segments that begin at the corners and lead away along an axis (0: up and down)."""
    sums = edges._strength[axis] if axis == 0 else edges._strength[1].T
    low, high = boxes[:, 1 - axis], boxes[:, 3 - axis]
    reach = np.maximum((high - low) // 3, 3)
    lines = np.clip(boxes.T[[axis, axis + 2], None] + np.array([[-1], [0], [1]]), 0, sums.shape[1] - 1)
    pieces = [
        _mean_step(sums, lines, a, b).max(axis=1) for a, b in ((low - 1 - reach, low - 1), (high + 1, high + 1 + reach))
    ]
    return np.asarray(np.median(np.concatenate(pieces), axis=0) / edges.threshold)


def _mean_step(sums: Float32Array, lines: IntArray, a: IntArray, b: IntArray) -> FloatArray:
    """(…, N) absolute mean steps on lines from a to b (N,); 0 beyond the picture."""
    begin, end = (np.clip(v, 0, sums.shape[0] - 1) for v in (a, b))
    return np.asarray(np.abs(sums[end, lines] - sums[begin, lines]) / np.maximum(b - a, 1), np.float64)


def local_deviation(picture: Picture, channels: Sequence[Edges]) -> float:
    """Median of the standard deviation of brightness within squares of `SQUARE_M`, in thresholds."""
    size = (max(round(picture.pixels(SQUARE_M)), 3),) * 2
    mean, squares = (cv2.boxFilter(v.astype(np.float64), -1, size) for v in (picture.light, picture.light**2))
    scatter = np.sqrt(np.maximum(squares - mean**2, 0))[picture.seen]
    return float(np.clip(np.median(scatter) / channels[0].threshold, 0, 6)) if len(scatter) else 0.0


def confidence(
    found: Candidates, support: IntArray, completed: FloatArray, picture: Picture, channels: Sequence[Edges]
) -> FloatArray:
    """(N,) 0 to 1."""
    return np.asarray(1 / (1 + np.exp(-features(found, support, completed, picture, channels) @ WEIGHTS)))
