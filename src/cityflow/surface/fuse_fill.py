"""Fills holes of the fused surface: ground continues behind a wall, a roof across a gap in it."""

from __future__ import annotations

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit

DIRECTIONS = (
    (0, 1), (1, 2), (1, 1), (2, 1), (1, 0), (2, -1), (1, -1), (1, -2),
    (0, -1), (-1, -2), (-1, -1), (-2, -1), (-1, 0), (-2, 1), (-1, 1), (-1, 2),
)  # fmt: skip
"""Rows and columns of a step along each ray."""


def fill_from_below(
    values: FloatArray, reach: int, step: float, slope: float, part: tuple[slice, slice] = (slice(None), slice(None))
) -> FloatArray:
    """A part of the raster (rows, columns) with its holes filled as far as `reach` cells from what was measured.

    From a hole's cell sixteen rays look for the first measured cell. Their heights, from the lowest up, belong together as long as no gap is wider
    than `step` metres and `slope` metres per cell between the places; the lowest group with two rays or more fills the cell, by the plane or, where
    that is not held on all sides, by the mean weighted with the inverse squared distances. A cell with rays into nothing only stays NaN.
    """
    filled, holes = values[part].copy(), np.isnan(values)
    # distances in moves of a chess king: rays leap over what is known to be empty
    empty = np.asarray(cv2.distanceTransform(holes.astype(np.uint8), cv2.DIST_C, 3), np.float32)
    within = np.zeros(values.shape, bool)
    within[part] = True
    rows, cols = np.nonzero(holes & (empty <= reach) & within)
    # numpy gives arrays of their own for one hole and parts of one for more, and the kernel would be compiled for both
    rows, cols = np.ascontiguousarray(rows), np.ascontiguousarray(cols)
    found = _fill(values, empty, rows, cols, np.array(DIRECTIONS, np.int64), reach, step, slope)
    filled[np.isnan(filled) & (empty[part] <= reach)] = found
    return filled


@njit(cache=True, nogil=True)
def _fill(
    z: FloatArray, empty: Float32Array, at_row: IntArray, at_col: IntArray, directions: IntArray, reach: int,
    step: float, slope: float,
) -> FloatArray:  # fmt: skip
    out = np.full(len(at_row), np.nan)
    height, x, y = np.empty(len(directions)), np.empty(len(directions)), np.empty(len(directions))
    for k in range(len(at_row)):
        n = 0
        for d in range(len(directions)):
            d_r, d_c = directions[d]
            found = _first(empty, at_row[k], at_col[k], d_r, d_c, reach)
            if found == 0:
                continue
            h = z[at_row[k] + found * d_r, at_col[k] + found * d_c]
            m = n
            while m > 0 and height[m - 1] > h:
                height[m], x[m], y[m] = height[m - 1], x[m - 1], y[m - 1]
                m -= 1
            height[m], x[m], y[m] = h, found * d_c, found * d_r
            n += 1
        if n:
            out[k] = _from_lowest(height, x, y, n, step, slope)
    return out


@njit(cache=True, nogil=True)
def _first(empty: Float32Array, r: int, c: int, d_r: int, d_c: int, reach: int) -> int:
    """Steps to the first measured cell along a direction, 0 where there is none."""
    most = int(reach / np.sqrt(float(d_r * d_r + d_c * d_c)))
    leap = max(abs(d_r), abs(d_c))
    s = 0
    while s <= most:
        i, j = r + s * d_r, c + s * d_c
        if i < 0 or j < 0 or i >= empty.shape[0] or j >= empty.shape[1]:
            return 0
        if empty[i, j] == 0:
            return s
        # both leaps by themselves: to divide by a number that is not known beforehand takes longer than all the rest
        away = int(empty[i, j])
        s += away if leap == 1 else (away + 1) >> 1
    return 0


@njit(cache=True, nogil=True)
def _from_lowest(height: FloatArray, x: FloatArray, y: FloatArray, n: int, step: float, slope: float) -> float:
    first, last = 0, n
    begin = 0
    for m in range(1, n + 1):
        apart = 0.0
        if m < n:
            apart = np.sqrt((x[m] - x[m - 1]) ** 2 + (y[m] - y[m - 1]) ** 2)
        if m == n or height[m] - height[m - 1] > step + slope * apart:
            if m - begin >= 2:
                first, last = begin, m
                break
            begin = m
    total, value = 0.0, 0.0
    for m in range(first, last):
        w = 1.0 / (x[m] * x[m] + y[m] * y[m])
        total += w
        value += w * height[m]
    return value / total
