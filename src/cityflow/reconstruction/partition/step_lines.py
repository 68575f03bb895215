"""Lines along step edges: they separate neighbouring roofs that do not meet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.partition.borders import Borders, unique_pairs
from cityflow.reconstruction.partition.cut_line import CutLine

ASIDE_M, GAP_M, SQUARE_M = 0.15, 2.0, 0.3
"""A line parts pairs that it misses by so much; a stretch of it ends at a gap so long, and its length is counted in such pieces; set by hand."""


def angle_between(a: float, b: float) -> float:
    difference = abs(a - b) % math.pi
    return min(difference, math.pi - difference)


def step_lines(borders: Borders, directions: list[float], min_length: float, most: int) -> list[CutLine]:
    """Lines that part the points of neighbouring planes, longest first, in given directions where these fit.

    Each line takes the offset that lies between the two points of as many pairs as possible; the pairs that it parts
    are taken away before the next one is sought.
    """
    lines: list[CutLine] = []
    own = _own_directions(borders, min_length)
    for direction in own:
        if all(angle_between(direction, d) > math.radians(8) for d in directions):
            directions = [*directions, direction]
    ways = [_pairs_along(borders, direction) for direction in directions]
    left = np.ones(len(borders), dtype=bool)
    while len(lines) < most and np.count_nonzero(left) >= 3:
        trials = [_best_line(way, left) for way in ways]
        line, parted = max(trials, key=lambda trial: trial[0].support)
        if line.support < min_length:
            break
        lines.append(line)
        left[parted] = False
    return lines


def _own_directions(borders: Borders, min_length: float) -> list[float]:
    """Directions of the borders of single plane pairs that are straight and long."""
    found = []
    for pair in unique_pairs(borders.planes):
        middle = borders.middle[np.all(borders.planes == pair, axis=1)]
        if len(middle) < 6:
            continue
        centred = middle - middle.mean(axis=0)
        values, vectors = np.linalg.eigh(centred.T @ centred / len(middle))
        if math.sqrt(12 * values[1]) > 2 * min_length and values[0] < 0.03 * values[1]:
            found.append((float(values[1]), math.atan2(vectors[1, 1], vectors[0, 1]) % math.pi))
    return [angle for _, angle in sorted(found, reverse=True)]


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Pairs of points as a line of one direction meets them, in their order along it.

    Attributes
    ----------
    nx, ny : normal of the line
    order : (N,) numbers of the pairs, but for those that run along the line: these say nothing of where it lies
    low, high, along : (N,) offsets of a pair's points across the line, and its place along it, metres
    """

    nx: float
    ny: float
    order: IntArray
    low: FloatArray
    high: FloatArray
    along: FloatArray


def _pairs_along(borders: Borders, direction: float) -> _Pairs:
    nx, ny = -math.sin(direction), math.cos(direction)
    gap = borders.second - borders.first
    near, far, along = borders.first @ (nx, ny), borders.second @ (nx, ny), borders.middle @ (-ny, nx)
    order = np.argsort(along, kind="stable")
    order = order[(np.abs(gap @ (nx, ny)) > 0.6 * np.hypot(gap[:, 0], gap[:, 1]))[order]]
    near, far = near[order], far[order]
    return _Pairs(nx, ny, order, np.minimum(near, far), np.maximum(near, far), along[order])


def _best_line(pairs: _Pairs, left: BoolArray) -> tuple[CutLine, IntArray]:
    """The line of this direction that parts most of the pairs left over the longest stretch, and the pairs it parts."""
    mine = left[pairs.order]
    low, high, along = pairs.low[mine], pairs.high[mine], pairs.along[mine]
    offsets = np.array(_stabbing_offsets(low, high), np.float64)
    offset, start, end, covered = _longest_run(low, high, along, offsets)
    if covered == 0:
        return CutLine(pairs.nx, pairs.ny, 0.0, 0.0, 0.0, 0.0), pairs.order[:0]
    parted = (low - ASIDE_M <= offset) & (offset <= high + ASIDE_M) & (along >= start) & (along <= end)
    line = CutLine(pairs.nx, pairs.ny, offset, start - 0.4, end + 0.4, covered)
    return _centred(line, low[parted], high[parted]), pairs.order[mine][parted]


@njit(cache=True, nogil=True)
def _longest_run(
    low: FloatArray, high: FloatArray, along: FloatArray, offsets: FloatArray
) -> tuple[float, float, float, float]:
    """Offset, start, end and metres covered of the longest stretch without a gap of the pairs that a line at one of the offsets parts."""
    best = (0.0, 0.0, 0.0, 0.0)
    for offset in offsets:
        count = squares = 0
        start = end = 0.0
        for i in range(len(along)):
            if not (low[i] - ASIDE_M <= offset <= high[i] + ASIDE_M):
                continue
            if count == 0 or along[i] - end > GAP_M:
                count = squares = 0
                start = along[i]
            if squares == 0 or np.floor(along[i] / SQUARE_M) > np.floor(end / SQUARE_M):
                squares += 1
            end = along[i]
            count += 1
            if count >= 3 and SQUARE_M * squares > best[3]:
                best = (offset, start, end, SQUARE_M * squares)
            elif count >= 3 and best[:2] == (offset, start):
                best = (offset, start, end, best[3])
    return best


def _stabbing_offsets(low: FloatArray, high: FloatArray) -> list[float]:
    """Offsets that lie within most of the intervals low–high: the three best, at least 0.3 m apart."""
    if len(low) == 0:
        return []
    edges = np.arange(low.min() - 0.05, high.max() + 0.15, 0.1)
    count = np.searchsorted(np.sort(low), edges, side="right") - np.searchsorted(np.sort(high), edges, side="left")
    best: list[float] = []
    order = np.argsort(-count, kind="stable")
    for edge in edges[order[count[order] >= 3]].tolist():
        if len(best) == 3:
            break
        if all(abs(edge - other) > 0.3 for other in best):
            best.append(edge)
    return best


def _centred(line: CutLine, low: FloatArray, high: FloatArray) -> CutLine:
    """The same line in the middle of the offsets that part most of the pairs."""
    trial = np.unique(np.concatenate([low, high, [line.offset]]))
    middles = (trial[1:] + trial[:-1]) / 2 if len(trial) > 1 else trial
    inside = (low <= middles[:, None]) & (middles[:, None] <= high)
    count = inside.sum(axis=1)
    best = middles[count == count.max()]
    offset = float((best[0] + best[-1]) / 2)
    return CutLine(line.nx, line.ny, offset, line.start, line.end, line.support)
