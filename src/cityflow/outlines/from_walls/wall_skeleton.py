"""Strips of wall cells thinned to paths: dilation, skeleton, and its longest ways (Nex et al. 2013 §2.3)."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, ByteArray, IntArray
from cityflow.core.kernels import njit


def paths(row: IntArray, col: IntArray, sure: BoolArray, bridge: int, least: int) -> list[tuple[IntArray, bool]]:
    """Ways along a strip, from end to end, through the middle of its cells.

    Parameters
    ----------
    row, col, sure : (N,) cells of one strip, each place once or more
    bridge : gaps up to so many cells are closed
    least : shorter ways are left out, cells

    Returns
    -------
    Rows and columns of cells (M, 2), one after the other, and whether the way is sure: its ends are, and what lies between is bridged.
    Ends of the reserve are ways of their own, which are not sure.
    """
    grow = bridge // 2 + 1
    r_0, c_0 = int(row.min()) - grow - 2, int(col.min()) - grow - 2
    shape = int(row.max()) - r_0 + grow + 3, int(col.max()) - c_0 + grow + 3
    mask, founded = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    mask[row - r_0, col - c_0] = 1
    founded[(row - r_0)[sure], (col - c_0)[sure]] = 1
    brush = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * grow + 1, 2 * grow + 1))
    grown = cv2.dilate(mask, brush).astype(np.uint8)
    # a path keeps to the middle of its strip, so what is sure beside it counts
    near_founded = cv2.dilate(founded, np.ones((2 * grow + 1, 2 * grow + 1), np.uint8))
    found = []
    for way in _ways(skeleton(grown), 2 * grow + 1, max(least, 2)):
        held = np.flatnonzero(near_founded[way[:, 0], way[:, 1]])
        cuts = [0, 0, len(way)] if not len(held) else [0, int(held[0]), int(held[-1]) + 1, len(way)]
        for k, (begin, end) in enumerate(pairwise(cuts)):
            if end - begin >= least:
                found.append((way[begin:end] + np.array([r_0, c_0]), k == 1 and len(held) > 0))
    return found


def skeleton(mask: ByteArray) -> ByteArray:
    """Lines of one cell's width through the middle of the shapes of ones, by the two-pass thinning of Guo and Hall (1989).

    The rim of the mask must be empty.
    """
    thin = np.ascontiguousarray(mask > 0).astype(np.uint8)
    _guo_hall(thin)
    return thin


def _ways(thin: ByteArray, width: int, least: int) -> list[IntArray]:
    """Longest way of every connected part, then of what is left further than `width` from it, and so on."""
    left, found = thin.copy(), []
    brush = np.ones((2 * width + 1, 2 * width + 1), np.uint8)
    for _ in range(len(thin) * len(thin[0])):
        ways = _longest(left, least)
        if not ways:
            break
        taken = np.zeros_like(left)
        for way in ways:
            taken[way[:, 0], way[:, 1]] = 1
        left[cv2.dilate(taken, brush) > 0] = 0
        found += ways
    return found


def _longest(thin: ByteArray, least: int) -> list[IntArray]:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(thin, connectivity=8, ltype=cv2.CV_32S)
    found = []
    for k in range(1, count):
        if stats[k, cv2.CC_STAT_AREA] < least:
            continue
        left, top, width, height = (int(stats[k, j]) for j in range(4))
        part = np.zeros((height + 2, width + 2), np.uint8)
        part[1:-1, 1:-1] = labels[top : top + height, left : left + width] == k
        way = _diameter(part)
        if len(way) >= least:
            found.append(way + np.array([top - 1, left - 1]))
    return found


def _diameter(part: ByteArray) -> IntArray:
    """The way between two cells of a connected skeleton that are furthest apart along it (of a ring, half of it)."""
    first = np.argwhere(part)[0]
    far, _ = _walk(part, int(first[0]), int(first[1]))
    end, came = _walk(part, *divmod(far, part.shape[1]))
    way = [end]
    while came[way[-1]] >= 0:
        way.append(int(came[way[-1]]))
    return np.column_stack(np.divmod(np.array(way, np.int64), part.shape[1]))


@njit(cache=True, nogil=True)
def _walk(part: ByteArray, row: int, col: int) -> tuple[int, IntArray]:
    """Breadth first: the last cell reached, and from where each cell was reached (-1: not at all, or the start)."""
    cols = part.shape[1]
    came, seen = np.full(part.size, -1, np.int64), np.zeros(part.size, np.bool_)
    queue = np.empty(part.size, np.int64)
    queue[0] = row * cols + col
    seen[queue[0]] = True
    head, tail = 0, 1
    # straight steps before slanting ones, so that ways do not zigzag
    steps = np.array([-1, 1, -cols, cols, -cols - 1, -cols + 1, cols - 1, cols + 1])
    flat = part.ravel()
    while head < tail:
        here = queue[head]
        head += 1
        for step in steps:
            there = here + step
            if flat[there] and not seen[there]:
                seen[there] = True
                came[there] = here
                queue[tail] = there
                tail += 1
    return queue[tail - 1], came


@njit(cache=True, nogil=True)
def _guo_hall(thin: ByteArray) -> None:
    rows, cols = thin.shape
    doomed = np.empty((thin.size, 2), np.int64)
    changed = True
    while changed:
        changed = False
        for turn in range(2):
            count = 0
            for r in range(1, rows - 1):
                for c in range(1, cols - 1):
                    if thin[r, c] and _removable(thin, r, c, turn):
                        doomed[count, 0], doomed[count, 1] = r, c
                        count += 1
            for k in range(count):
                thin[doomed[k, 0], doomed[k, 1]] = 0
            changed = changed or count > 0


@njit(cache=True, nogil=True)
def _removable(thin: ByteArray, r: int, c: int, turn: int) -> bool:
    p2, p3, p4, p5 = thin[r - 1, c], thin[r - 1, c + 1], thin[r, c + 1], thin[r + 1, c + 1]
    p6, p7, p8, p9 = thin[r + 1, c], thin[r + 1, c - 1], thin[r, c - 1], thin[r - 1, c - 1]
    crossings = (1 - p2) * (p3 | p4) + (1 - p4) * (p5 | p6) + (1 - p6) * (p7 | p8) + (1 - p8) * (p9 | p2)
    if crossings != 1:
        return False
    around = min((p9 | p2) + (p3 | p4) + (p5 | p6) + (p7 | p8), (p2 | p3) + (p4 | p5) + (p6 | p7) + (p8 | p9))
    if around < 2 or around > 3:
        return False
    if turn == 0:
        return ((p6 | p7 | (1 - p9)) & p8) == 0
    return ((p2 | p3 | (1 - p5)) & p4) == 0
