"""Patches as runs of pixels along the rows, in all four quarter turns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, IntArray
from cityflow.core.kernels import njit

TURNS = 4
"""Quarter turns of a patch."""

RunArray = NDArray[np.int32]


class Patches(NamedTuple):
    """All patches in all turns; number 4·i + q is mask i as ``numpy.rot90(mask, q)`` turns it.

    Attributes
    ----------
    runs : (n, 3) int32, row, first column and length of each run of pixels, the turned patches one after another. The longest run of
        a patch comes first, the others in an order that leaps up and down: a collision is then met after few of them.
    starts : (4·P + 1,) int64, where the runs of a turned patch begin
    shapes : (4·P, 2) int64, rows and columns of the turned mask
    distinct : (4·P,) bool, False where a smaller turn of the same mask looks alike
    squares : (4·P, 3) int64, edge, row and column of the largest square in the turned patch
    pixels : (P,) int64, size of the set
    """

    runs: RunArray
    starts: IntArray
    shapes: IntArray
    distinct: BoolArray
    squares: IntArray
    pixels: IntArray


def patches_of(masks: Sequence[BoolArray]) -> Patches:
    """The runs of boolean (rows, cols) masks, each with at least one pixel."""
    shapes = np.array([m.shape for m in masks], np.int64).reshape(-1, 2)
    flat = np.concatenate([np.ascontiguousarray(m, np.bool_).ravel() for m in masks] or [np.empty(0, np.bool_)])
    begins = np.concatenate([[0], np.cumsum(shapes.prod(axis=1))]).astype(np.int64)
    counts, pixels = _counted(flat.view(np.uint8), begins, shapes)
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    runs = np.empty((starts[-1], 3), np.int32)
    _fill(flat.view(np.uint8), begins, shapes, starts, runs)
    turned = np.where((np.arange(TURNS) % 2 == 0)[:, None], shapes[:, None, :], shapes[:, None, ::-1]).reshape(-1, 2)
    squares = _squares(flat.view(np.uint8), begins, shapes)
    return Patches(runs, starts, turned, _distinct(runs, starts, turned), squares, pixels)


@njit(cache=True, nogil=True)
def _counted(flat: ByteArray, begins: IntArray, shapes: IntArray) -> tuple[IntArray, IntArray]:
    """(4·P,) runs of each turned patch, and (P,) pixels of each."""
    counts = np.zeros(TURNS * len(shapes), np.int64)
    pixels = np.zeros(len(shapes), np.int64)
    for p in range(len(shapes)):
        rows, cols = shapes[p]
        mask = flat[begins[p] : begins[p + 1]].reshape(rows, cols)
        along = down = 0
        for r in range(rows):
            for c in range(cols):
                if mask[r, c]:
                    pixels[p] += 1
                    along += c == 0 or not mask[r, c - 1]
                    down += r == 0 or not mask[r - 1, c]
        counts[TURNS * p : TURNS * p + TURNS : 2] = along
        counts[TURNS * p + 1 : TURNS * p + TURNS : 2] = down
    return counts, pixels


@njit(cache=True, nogil=True)
def _fill(flat: ByteArray, begins: IntArray, shapes: IntArray, starts: IntArray, runs: RunArray) -> None:
    for p in range(len(shapes)):
        rows, cols = shapes[p]
        mask = flat[begins[p] : begins[p + 1]].reshape(rows, cols)
        along, down = _runs(mask), _runs(mask.T)
        for q in range(TURNS):
            source = along if q % 2 == 0 else down
            height, width = (rows, cols) if q % 2 == 0 else (cols, rows)
            turned = source.copy()
            # the columns, read from the last to the first, are the rows of the first quarter turn
            if q == 1 or q == 2:
                turned[:, 0] = height - 1 - source[:, 0]
            if q == 2 or q == 3:
                turned[:, 1] = width - source[:, 1] - source[:, 2]
            _leaping(turned, runs[starts[TURNS * p + q] : starts[TURNS * p + q + 1]])


@njit(cache=True, nogil=True)
def _runs(mask: ByteArray) -> RunArray:
    """(n, 3) row, first column, length."""
    rows, cols = mask.shape
    count = 0
    for r in range(rows):
        for c in range(cols):
            count += mask[r, c] and (c == 0 or not mask[r, c - 1])
    runs = np.empty((count, 3), np.int32)
    n = -1
    for r in range(rows):
        for c in range(cols):
            if mask[r, c]:
                if c == 0 or not mask[r, c - 1]:
                    n += 1
                    runs[n, 0], runs[n, 1], runs[n, 2] = r, c, 0
                runs[n, 2] += 1
    return runs


@njit(cache=True, nogil=True)
def _leaping(source: RunArray, target: RunArray) -> None:
    """Copy runs: by row, the longest first, then in the order of a van der Corput sequence."""
    ordered = source[np.argsort(source[:, 0] * 65536 + source[:, 1])]
    longest = np.argmax(ordered[:, 2])
    target[0] = ordered[longest]
    bits = 0
    while (1 << bits) < len(ordered):
        bits += 1
    n = 1
    for i in range(1 << bits):
        k, rest = 0, i
        for _ in range(bits):
            k, rest = 2 * k + rest % 2, rest // 2
        if k < len(ordered) and k != longest:
            target[n] = ordered[k]
            n += 1


@njit(cache=True, nogil=True)
def _distinct(runs: RunArray, starts: IntArray, shapes: IntArray) -> BoolArray:
    distinct = np.ones(len(shapes), np.bool_)
    for first in range(0, len(shapes), TURNS):
        for q in range(1, TURNS):
            for other in range(q):
                a, b = first + q, first + other
                if np.array_equal(shapes[a], shapes[b]) and np.array_equal(
                    runs[starts[a] : starts[a + 1]], runs[starts[b] : starts[b + 1]]
                ):
                    distinct[a] = False
    return distinct


@njit(cache=True, nogil=True)
def _squares(flat: ByteArray, begins: IntArray, shapes: IntArray) -> IntArray:
    """(4·P, 3) edge, row, column of the largest square in each turned patch."""
    result = np.empty((TURNS * len(shapes), 3), np.int64)
    for p in range(len(shapes)):
        rows, cols = shapes[p]
        edge, row, col = _largest_square(flat[begins[p] : begins[p + 1]].reshape(rows, cols))
        below, right = rows - row - edge, cols - col - edge
        for q, corner in enumerate(((row, col), (right, row), (below, right), (col, below))):
            result[TURNS * p + q, 0] = edge
            result[TURNS * p + q, 1] = corner[0]
            result[TURNS * p + q, 2] = corner[1]
    return result


@njit(cache=True, nogil=True)
def _largest_square(mask: ByteArray) -> tuple[int, int, int]:
    """Edge, row and column; every pixel knows the largest square that ends in it from those of its three neighbours."""
    ends = np.zeros(mask.shape[1] + 1, np.int64)
    edge = row = col = 0
    for r in range(mask.shape[0]):
        diagonal = 0
        for c in range(mask.shape[1]):
            above = ends[c + 1]
            ends[c + 1] = min(diagonal, above, ends[c]) + 1 if mask[r, c] else 0
            diagonal = above
            if ends[c + 1] > edge:
                edge, row, col = ends[c + 1], r - ends[c + 1] + 1, c - ends[c + 1] + 1
    return edge, row, col
