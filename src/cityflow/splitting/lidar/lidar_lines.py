"""Fits candidate lines to LiDAR points: between two planes, at a step, or along points above both sides.

A raster of points is coarse, so a line found in it is off by a cell. The points know better: a crease is where the planes
of both sides meet, a step is the line that parts the points of the upper plane from those of the lower one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.splitting.lidar.lidar_borders import FITTING_M, STRIDE_M, WALL_M, crease, firewall, step
from cityflow.splitting.lidar.lidar_planes import BESIDE_M, DEEP_M, Near, axes, beside, gap_between, off, side_planes

NONE, CREASE, STEP, FIREWALL = 0, 1, 2, 3
ROUNDS = 2
BEND_RAD = 0.07
STEP_M = 0.1
LONGEST_M = 40.0
TURN = 3.0


class LaidLines(NamedTuple):
    """Lines as the points have them.

    Attributes
    ----------
    ends : (M, 2, 3) float64, start and end, metres
    kind : (M,) int64, `NONE` where points show no line
    height : (M,) float64, of the step or wall, metres;  bend : between the slopes of both sides, radians
    scatter : (M,) float64, of the points about the planes, metres
    """

    ends: FloatArray
    kind: IntArray
    height: FloatArray
    bend: FloatArray
    scatter: FloatArray

    def take(self, which: BoolArray | IntArray) -> LaidLines:
        return LaidLines(self.ends[which], self.kind[which], self.height[which], self.bend[which], self.scatter[which])


class _Laid(NamedTuple):
    ends: FloatArray
    kind: int
    height: float
    bend: float
    scatter: float


@njit(cache=True, nogil=True)
def laid_lines(points: FloatArray, lines: FloatArray, freedom_deg: float) -> LaidLines:
    """Lines laid through points.

    Parameters
    ----------
    points : (N, 3) float64, metres from a near origin, in the order of x
    lines : (M, 2, 2) x, y of both ends
    freedom_deg : how far a line may turn at first; later less
    """
    m, n = len(lines), len(points)
    result = LaidLines(np.zeros((m, 2, 3)), np.zeros(m, np.int64), np.zeros(m), np.zeros(m), np.zeros(m))
    room = Near(np.empty(n), np.empty(n), np.empty(n))
    for i in range(m):
        ends = lines[i].copy()
        found = _nothing()
        for turn in range(2 * ROUNDS):
            found = _lay(beside(points, ends, room), ends, turn, freedom_deg)
            # a line that has found its place is drawn out, and laid once more in its whole length
            if found.kind != NONE and turn >= ROUNDS - 1:
                found = _stretched(points, found, room)
            if found.kind == NONE or (turn >= ROUNDS and _unmoved(ends, found.ends)):
                break
            ends = found.ends[:, :2].copy()
        result.ends[i], result.kind[i], result.height[i] = found.ends, found.kind, found.height
        result.bend[i], result.scatter[i] = found.bend, found.scatter
    return result


@njit(cache=True, nogil=True)
def _nothing() -> _Laid:
    return _Laid(np.zeros((2, 3)), NONE, 0.0, 0.0, 0.0)


@njit(cache=True, nogil=True)
def _freedom(turn: int, freedom_deg: float) -> float:
    """How far a line may turn in this round, radians: what is long knows its direction."""
    return np.radians(freedom_deg if turn == 0 else freedom_deg * (0.5 if turn < ROUNDS else 0.25))


@njit(cache=True, nogil=True)
def _unmoved(old: FloatArray, new: FloatArray) -> bool:
    start = np.hypot(old[0, 0] - new[0, 0], old[0, 1] - new[0, 1])
    return start + np.hypot(old[1, 0] - new[1, 0], old[1, 1] - new[1, 1]) < 0.05


@njit(cache=True, nogil=True)
def _lay(near: Near, ends: FloatArray, turn: int, freedom_deg: float) -> _Laid:
    """One round: planes of both sides, then the line between them."""
    ax, ay, length = axes(ends)
    known, left, right = side_planes(near, BESIDE_M if turn else 1.5 * BESIDE_M)
    if not known:
        return _nothing()
    scatter = max(left.scatter, right.scatter, 0.015)
    bend = abs(np.arctan(left.tilt) - np.arctan(right.tilt))
    gap = gap_between(left, right, length)
    kind, height, found, start, end = NONE, 0.0, False, 0.0, 0.0
    if bend > BEND_RAD:
        found, start, end = crease(left, right, length)
        kind = CREASE
    if not found and abs(gap) > max(STEP_M, 2.5 * scatter):
        found, start, end = step(near, left, right, length, _freedom(turn, freedom_deg))
        kind, height = STEP, abs(gap)
    if not found and abs(gap) < 0.5:
        found, start, end = firewall(near, left, right, length)
        kind, height = FIREWALL, WALL_M
    if not found or abs(end - start) > length * np.tan(np.radians(TURN * freedom_deg)):
        return _nothing()
    upper = left if gap > 0 or kind != STEP else right
    if kind == STEP:
        scatter = max(upper.scatter, 0.015)
    x, y = ends[0]
    return _Laid(
        np.array([
            [x - start * ay, y + start * ax, upper.level + upper.tilt * start],
            [x + length * ax - end * ay, y + length * ay + end * ax, upper.level + upper.rise * length + upper.tilt * end],
        ]),
        kind, height, bend, scatter,
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _stretched(points: FloatArray, laid: _Laid, room: Near) -> _Laid:
    """The line taken back, or on, to where the points of both sides leave their planes."""
    ends = laid.ends[:, :2].copy()
    ax, ay, length = axes(ends)
    if length > LONGEST_M:
        return laid
    along = np.array([ax, ay])
    near = beside(points, np.stack((ends[0] - LONGEST_M * along, ends[1] + LONGEST_M * along)), room)
    near = Near(near.along - LONGEST_M, near.left, near.z)
    inside = (near.along > -0.2) & (near.along < length + 0.2)
    known, left, right = side_planes(Near(near.along[inside], near.left[inside], near.z[inside]), 0.5 * BESIDE_M)
    if not known:
        return _nothing()
    gap = gap_between(left, right, length)
    first, last = int(-LONGEST_M / STRIDE_M), int((LONGEST_M + length) / STRIDE_M) + 1
    holds = np.zeros(last - first + 1)
    for side in range(2):
        plane, other, sign = (left, right, 1.0) if side == 0 else (right, left, -1.0)
        good, all_of = np.zeros(len(holds)), np.zeros(len(holds))
        for k in range(len(near.z)):
            if not 0.1 < near.left[k] * sign < 1.2:
                continue
            at = int(np.floor(near.along[k] / STRIDE_M)) - first
            if 0 <= at < len(holds):
                all_of[at] += 1
                point = near.along[k], near.left[k], near.z[k]
                fits = abs(off(plane, *point)) < max(1.5 * FITTING_M, 3 * plane.scatter)
                if gap * sign < -DEEP_M:  # the lower side of a high step need not be even
                    fits = off(other, *point) < -0.5 * DEEP_M
                good[at] += 1 if fits else 0
        for at in range(len(holds)):
            a, b = max(at - 1, 0), min(at + 2, len(holds))
            holds[at] += 1 if np.sum(good[a:b]) >= max(2.0, 0.75 * np.sum(all_of[a:b])) and good[at] > 0 else 0
    begin, end = _run(holds, max(-first, 0), min(int(length / STRIDE_M) - first, len(holds) - 1))
    if end < begin:
        return _nothing()
    t0, t1 = (begin + first) * STRIDE_M, (end + 1 + first) * STRIDE_M
    x, y, z = laid.ends[0]
    rise = (laid.ends[1, 2] - z) / length
    moved = np.array([[x + t0 * ax, y + t0 * ay, z + rise * t0], [x + t1 * ax, y + t1 * ay, z + rise * t1]])
    return _Laid(moved, laid.kind, laid.height, laid.bend, laid.scatter)


@njit(cache=True, nogil=True)
def _run(holds: FloatArray, first: int, last: int) -> tuple[int, int]:
    """The longest run of places within the line where both sides hold, drawn out beyond its ends; empty if there is none."""
    begin, end, at = 0, -1, first
    while at <= last:
        start = at
        while at <= last and holds[at] == 2:
            at += 1
        if at - start > end - begin + 1:
            begin, end = start, at - 1
        at += 1
    while end >= begin > 0 and holds[begin - 1] == 2:
        begin -= 1
    while begin <= end < len(holds) - 1 and holds[end + 1] == 2:
        end += 1
    return begin, end
