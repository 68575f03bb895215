"""Rows and columns of boxes: members, common edges, and gaps where a box is expected."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.windows.box_edges import box_areas

ALIKE = 0.8
"""Shorter by longer of widths or heights that count as equal; set by hand on drawn façades."""


def overlap(a: IntArray, b: IntArray) -> tuple[FloatArray, FloatArray]:
    """(N, M) intersection over union of boxes, and intersection by the smaller one."""
    wide, tall = (
        np.maximum(np.minimum(a[:, None, k + 2], b[None, :, k + 2]) - np.maximum(a[:, None, k], b[None, :, k]), 0)
        for k in (0, 1)
    )
    both = (wide * tall).astype(np.float64)
    area_a, area_b = box_areas(a), box_areas(b)
    return both / np.maximum(area_a[:, None] + area_b[None] - both, 1), both / np.maximum(
        np.minimum(area_a[:, None], area_b[None]), 1
    )


def in_row(a: IntArray, b: IntArray, tolerance: float) -> BoolArray:
    """(N, M) whether boxes stand side by side, with equal heights and widths."""
    level = (np.abs(a[:, None, [1, 3]] - b[None, :, [1, 3]]) <= tolerance).all(axis=2)
    return level & _alike(a, b, 0, tolerance) & _apart(a, b, 0)


def in_column(a: IntArray, b: IntArray, tolerance: float) -> BoolArray:
    """(N, M) whether boxes stand above one another, with equal widths and nearly equal heights."""
    upright = (np.abs(a[:, None, [0, 2]] - b[None, :, [0, 2]]) <= tolerance).all(axis=2)
    return upright & _alike(a, b, 1, tolerance) & _apart(a, b, 1)


def _alike(a: IntArray, b: IntArray, axis: int, tolerance: float) -> BoolArray:
    x, y = (v[:, axis + 2] - v[:, axis] for v in (a, b))
    short, long = np.minimum(x[:, None], y[None]), np.maximum(x[:, None], y[None])
    return np.asarray((short >= ALIKE * long) | (long - short <= tolerance))


def _apart(a: IntArray, b: IntArray, axis: int) -> BoolArray:
    return np.asarray((a[:, None, axis] >= b[None, :, axis + 2]) | (b[None, :, axis] >= a[:, None, axis + 2]))


def groups(together: BoolArray) -> IntArray:
    """(N,) number of the connected group of each."""
    return np.asarray(connected_components(csr_array(together), directed=False)[1], np.int64)


def aligned(boxes: IntArray, weights: FloatArray, tolerance: float) -> FloatArray:
    """Boxes with the common edges of their rows and columns: of each, the weighted median."""
    out = boxes.astype(np.float64)
    for together, sides in ((in_row(boxes, boxes, tolerance), (1, 3)), (in_column(boxes, boxes, tolerance), (0, 2))):
        group = groups(together)
        for g in np.flatnonzero(np.bincount(group, minlength=1) >= 2):
            of = group == g
            for side in sides:
                middle = _median(boxes[of, side].astype(np.float64), weights[of])
                near = of & (np.abs(boxes[:, side] - middle) <= tolerance)
                out[near, side] = middle
    return out


def _median(values: FloatArray, weights: FloatArray) -> float:
    """The weighted median, interpolated: boxes are whole cells, their common edge need not be."""
    order = np.argsort(values, kind="stable")
    share = np.cumsum(weights[order]) - 0.5 * weights[order]
    return float(np.interp(0.5 * weights.sum(), share, values[order]))


def places(boxes: IntArray, tolerance: float, reach: tuple[int, int]) -> IntArray:
    """(N, 4) boxes that rows and columns suggest where there is none yet.

    Parameters
    ----------
    reach : columns and rows of the picture
    """
    if len(boxes) < 2:
        return np.empty((0, 4), np.int64)
    rows, columns = in_row(boxes, boxes, tolerance), in_column(boxes, boxes, tolerance)
    asked = [
        *_crossings(boxes, rows, columns),
        *_between(boxes, rows, 0),
        *_between(boxes, columns, 1),
    ]
    if not asked:
        return np.empty((0, 4), np.int64)
    found = np.unique(np.array(asked, np.int64), axis=0)
    shared, _ = overlap(found, boxes)
    inside = (found[:, :2] >= 0).all(axis=1) & (found[:, 2] <= reach[0]) & (found[:, 3] <= reach[1])
    return np.asarray(found[inside & (shared.max(axis=1) < 0.1)])


def _crossings(boxes: IntArray, rows: BoolArray, columns: BoolArray) -> list[list[int]]:
    """Where the row of one box crosses the column of another."""
    row, column = groups(rows), groups(columns)
    asked = []
    for r in np.unique(row):
        top, bottom = np.rint(np.median(boxes[row == r][:, [1, 3]], axis=0)).astype(int)
        for c in np.unique(column):
            of = column == c
            left, right = np.rint(np.median(boxes[of][:, [0, 2]], axis=0)).astype(int)
            high = np.median(boxes[of, 3] - boxes[of, 1])
            if min(high, bottom - top) >= ALIKE * max(high, bottom - top):
                asked.append([int(left), int(top), int(right), int(bottom)])
    return asked


def _between(boxes: IntArray, together: BoolArray, axis: int) -> list[list[int]]:
    """Places at the spacing of a row (axis 0) or column (axis 1), and one beyond each end."""
    group = groups(together)
    asked = []
    for g in np.flatnonzero(np.bincount(group, minlength=1) >= 2):
        of = boxes[group == g]
        at = np.sort((of[:, axis] + of[:, axis + 2]) / 2)
        gaps = np.diff(at)
        pitch = float(gaps.min())
        size = np.rint(np.median(of, axis=0)).astype(int)
        half = (np.median(of[:, axis + 2] - of[:, axis])) / 2
        steps = [at[0] - pitch, at[-1] + pitch]
        for a, gap in zip(at, gaps, strict=False):
            n = round(gap / pitch)
            steps += [a + gap * k / n for k in range(1, n)] if abs(gap / pitch - n) < 0.2 else []
        for middle in steps:
            box = [int(v) for v in size]
            box[axis], box[axis + 2] = round(middle - half), round(middle + half)
            asked.append(box)
    return asked
