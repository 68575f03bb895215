"""Lines along step edges: neighbouring roofs that do not meet are parted by a line put between their points."""

from __future__ import annotations

import math

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.reconstruction.partition.borders import Borders, stretches
from cityflow.reconstruction.partition.subdivision import CutLine


def angle_between(a: float, b: float) -> float:
    difference = abs(a - b) % math.pi
    return min(difference, math.pi - difference)


def step_lines(borders: Borders, directions: list[float], min_length: float, most: int) -> list[CutLine]:
    """Lines that part the points of neighbouring planes, longest first, in given directions where these fit.

    Each line takes the offset that lies between the two points of as many pairs as possible; the pairs that it parts
    are taken away before the next one is sought.
    """
    left = borders
    lines: list[CutLine] = []
    own = _own_directions(borders, min_length)
    for direction in own:
        if all(angle_between(direction, d) > math.radians(8) for d in directions):
            directions = [*directions, direction]
    while len(lines) < most and len(left) >= 3:
        trials = [_best_line(left, direction) for direction in directions]
        line, parted = max(trials, key=lambda trial: trial[0].support)
        if line.support < min_length:
            break
        lines.append(line)
        left = left.take(~parted)
    return lines


def _own_directions(borders: Borders, min_length: float) -> list[float]:
    """Directions of the borders of single plane pairs that are straight and long."""
    found = []
    for pair in np.unique(borders.planes, axis=0):
        middle = borders.middle[np.all(borders.planes == pair, axis=1)]
        if len(middle) < 6:
            continue
        centred = middle - middle.mean(axis=0)
        values, vectors = np.linalg.eigh(centred.T @ centred / len(middle))
        if math.sqrt(12 * values[1]) > 2 * min_length and values[0] < 0.03 * values[1]:
            found.append((float(values[1]), math.atan2(vectors[1, 1], vectors[0, 1]) % math.pi))
    return [angle for _, angle in sorted(found, reverse=True)]


def _best_line(borders: Borders, direction: float) -> tuple[CutLine, BoolArray]:
    """The line of this direction that parts most pairs over the longest stretch, and the pairs it parts."""
    nx, ny = -math.sin(direction), math.cos(direction)
    gap = borders.second - borders.first
    across = np.abs(gap @ (nx, ny))
    # A pair that runs along the line says nothing about where it lies.
    useful = across > 0.6 * np.hypot(gap[:, 0], gap[:, 1])
    near, far = borders.first @ (nx, ny), borders.second @ (nx, ny)
    low, high = np.minimum(near, far), np.maximum(near, far)
    along = borders.middle @ (-ny, nx)
    none = CutLine(nx, ny, 0.0, 0.0, 0.0, 0.0), np.zeros(len(borders), dtype=bool)
    best, best_pairs = none
    for offset in _stabbing_offsets(low[useful], high[useful]):
        parted = useful & (low - 0.15 <= offset) & (offset <= high + 0.15)
        for start, end in stretches(along[parted], 2.0):
            run = parted & (along >= start) & (along <= end)
            covered = 0.3 * len(np.unique(np.floor(along[run] / 0.3)))
            if covered > best.support:
                best, best_pairs = CutLine(nx, ny, offset, start - 0.4, end + 0.4, covered), run
    if best.support > 0:
        best = _centred(best, low[best_pairs], high[best_pairs])
    return best, best_pairs


def _stabbing_offsets(low: FloatArray, high: FloatArray) -> list[float]:
    """Offsets that lie within most of the intervals low–high: the three best, at least 0.3 m apart."""
    if len(low) == 0:
        return []
    edges = np.arange(low.min() - 0.05, high.max() + 0.15, 0.1)
    count = np.searchsorted(np.sort(low), edges, side="right") - np.searchsorted(np.sort(high), edges, side="left")
    best: list[float] = []
    for k in np.argsort(-count, kind="stable"):
        if len(best) == 3 or count[k] < 3:
            break
        if all(abs(edges[k] - other) > 0.3 for other in best):
            best.append(float(edges[k]))
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
