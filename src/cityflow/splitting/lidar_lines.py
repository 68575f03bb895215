"""Fits candidate lines to LiDAR points: between two planes, at a step, or along points above both sides.

A raster of points is coarse, so a line found in it is off by a cell. The points know better: a crease is where the planes
of both sides meet, a step is the line that parts the points of the upper plane from those of the lower one.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit

NONE, CREASE, STEP, FIREWALL = 0, 1, 2, 3
X0, Y0, Z0, X1, Y1, Z1, KIND, HEIGHT, BEND, SCATTER = range(10)
REACH_M, BESIDE_M = 1.8, 0.3
"""Planes are fitted to points so far from the line; nearer ones may belong to either side."""
ROUNDS, REWEIGHTED = 2, 4
LEAST_POINTS = 6
BEND_RAD, AWAY_M = 0.07, 1.1
STEP_M, WALL_M = 0.1, 0.2
FITTING_M = 0.08
"""A point belongs to a plane that is this near, or three times the plane's scatter."""
STRIDE_M, LONGEST_M = 0.5, 40.0
DEEP_M, BUSHES_M = 0.8, 0.3
ANGLES, TURN = 13, 3.0
PARTED = 0.9
"""Share of the points on their own side of a step."""


@njit(cache=True, nogil=True)
def laid_lines(points: FloatArray, lines: FloatArray, freedom_deg: float) -> FloatArray:
    """(M, 10) lines as the points have them: ends (metres), kind, height of the step or wall, bend (radians), scatter.

    Parameters
    ----------
    points : (N, 3) float64, metres from a near origin, in the order of x
    lines : (M, 4) x, y of both ends
    freedom_deg : how far a line may turn at first; later less
    """
    result = np.zeros((len(lines), 10))
    near = np.empty((len(points), 3))
    for i in range(len(lines)):
        line = lines[i].copy()
        for turn in range(2 * ROUNDS):
            count = _beside(points, line, near)
            _lay(near[:count], line, turn, freedom_deg, result[i])
            # a line that has found its place is drawn out, and laid once more in its whole length
            if result[i, KIND] != NONE and turn >= ROUNDS - 1:
                _stretch(points, result[i], near)
            if result[i, KIND] == NONE or (turn >= ROUNDS and _unmoved(line, result[i])):
                break
            line[0], line[1], line[2], line[3] = result[i, X0], result[i, Y0], result[i, X1], result[i, Y1]
    return result


@njit(cache=True, nogil=True)
def _freedom(turn: int, freedom_deg: float) -> float:
    """How far a line may turn in this round, radians: what is long knows its direction."""
    return np.radians(freedom_deg if turn == 0 else freedom_deg * (0.5 if turn < ROUNDS else 0.25))


@njit(cache=True, nogil=True)
def _unmoved(line: FloatArray, result: FloatArray) -> bool:
    start = np.hypot(line[0] - result[X0], line[1] - result[Y0])
    return start + np.hypot(line[2] - result[X1], line[3] - result[Y1]) < 0.05


@njit(cache=True, nogil=True)
def _axes(line: FloatArray) -> tuple[float, float, float]:
    length = np.hypot(line[2] - line[0], line[3] - line[1])
    return (line[2] - line[0]) / length, (line[3] - line[1]) / length, length


@njit(cache=True, nogil=True)
def _beside(points: FloatArray, line: FloatArray, near: FloatArray) -> int:
    """Points within reach of the line, as metres along it, to the left of it, and height."""
    ax, ay, length = _axes(line)
    count = 0
    first = np.searchsorted(points[:, 0], min(line[0], line[2]) - REACH_M - 0.2)
    last = np.searchsorted(points[:, 0], max(line[0], line[2]) + REACH_M + 0.2)
    for k in range(first, last):
        dx, dy = points[k, 0] - line[0], points[k, 1] - line[1]
        t, u = dx * ax + dy * ay, dy * ax - dx * ay
        if -0.2 <= t <= length + 0.2 and abs(u) <= REACH_M:
            near[count, 0], near[count, 1], near[count, 2] = t, u, points[k, 2]
            count += 1
    return count


@njit(cache=True, nogil=True)
def _lay(near: FloatArray, line: FloatArray, turn: int, freedom_deg: float, result: FloatArray) -> None:
    """One round: planes of both sides, then the line between them."""
    ax, ay, length = _axes(line)
    result[KIND] = NONE
    left, right = np.zeros(4), np.zeros(4)
    beside = BESIDE_M if turn else 1.5 * BESIDE_M
    if not _planes(near, beside, left, right):
        return
    scatter = max(left[3], right[3], 0.015)
    bend = abs(np.arctan(left[2]) - np.arctan(right[2]))
    gap = left[0] - right[0] + (left[1] - right[1]) * 0.5 * length
    ends = np.zeros(2)
    result[SCATTER], result[BEND] = scatter, bend
    if bend > BEND_RAD and _meet(left, right, length, ends):
        result[KIND], result[HEIGHT] = CREASE, 0.0
    elif abs(gap) > max(STEP_M, 2.5 * scatter) and _part(
        near, (left, right), (length, _freedom(turn, freedom_deg)), ends
    ):
        result[KIND], result[HEIGHT] = STEP, abs(gap)
    elif abs(gap) < 0.5 and _wall(near, (left, right), length, ends):
        result[KIND], result[HEIGHT] = FIREWALL, WALL_M
    else:
        return
    if abs(ends[1] - ends[0]) > length * np.tan(np.radians(TURN * freedom_deg)):
        result[KIND] = NONE
        return
    upper = left if gap > 0 or result[KIND] != STEP else right
    if result[KIND] == STEP:
        result[SCATTER] = max(upper[3], 0.015)
    result[X0], result[Y0] = line[0] - ends[0] * ay, line[1] + ends[0] * ax
    result[X1], result[Y1] = line[0] + length * ax - ends[1] * ay, line[1] + length * ay + ends[1] * ax
    result[Z0] = upper[0] + upper[2] * ends[0]
    result[Z1] = upper[0] + upper[1] * length + upper[2] * ends[1]


@njit(cache=True, nogil=True)
def _planes(near: FloatArray, beside: float, left: FloatArray, right: FloatArray) -> bool:
    """Of both sides. Where one is no plane but lies far below the other (bushes under an eave), the other stands for it, lowered."""
    has_left, has_right = _plane(near, 1.0, beside, left), _plane(near, -1.0, beside, right)
    if has_left and has_right:
        return True
    if not (has_left or has_right):
        return False
    known, lacking, sign = (left, right, -1.0) if has_left else (right, left, 1.0)
    there = near[near[:, 1] * sign > beside]
    if len(there) < LEAST_POINTS:
        return False
    fall = np.median(there[:, 2] - known[0] - known[1] * there[:, 0] - known[2] * there[:, 1])
    lacking[:] = known
    lacking[0] += fall
    lacking[3] = BUSHES_M
    return fall < -DEEP_M


@njit(cache=True, nogil=True)
def _belongs(point: FloatArray, upper: FloatArray, lower: FloatArray, deep: bool) -> int:
    """1 for a point of the upper plane, -1 for one of the lower one or, where that is deep down, anything well below the upper; 0 for neither."""
    to_upper = point[2] - upper[0] - upper[1] * point[0] - upper[2] * point[1]
    to_lower = point[2] - lower[0] - lower[1] * point[0] - lower[2] * point[1]
    if abs(to_upper) < max(FITTING_M, 3 * upper[3]) and abs(to_lower) > 2 * abs(to_upper):
        return 1
    if deep:
        return -1 if to_upper < -0.5 * DEEP_M else 0
    return -1 if abs(to_lower) < max(FITTING_M, 3 * lower[3]) and abs(to_upper) > 2 * abs(to_lower) else 0


@njit(cache=True, nogil=True)
def _plane(near: FloatArray, side: float, beside: float, plane: FloatArray) -> bool:
    """Height = plane[0] + plane[1]·t + plane[2]·u by least absolute deviations over one side; plane[3] is the scatter."""
    chosen = near[(near[:, 1] * side > beside)]
    n = len(chosen)
    if n < LEAST_POINTS:
        return False
    a = np.ones((n, 3))
    a[:, 1], a[:, 2] = chosen[:, 0], chosen[:, 1]
    if np.std(a[:, 1]) < 0.2 or np.std(a[:, 2]) < 0.15:
        return False
    middle = np.median(chosen[:, 2])
    z = chosen[:, 2] - middle
    weight = np.ones(n)
    x = np.zeros(3)
    for _ in range(REWEIGHTED):
        aw = a * weight.reshape(n, 1)
        x[:] = np.linalg.solve(a.T @ aw + np.eye(3) * 1e-9, aw.T @ z)
        weight[:] = 1.0 / np.maximum(np.abs(z - a @ x), 0.02)
    plane[0], plane[1], plane[2] = x[0] + middle, x[1], x[2]
    plane[3] = 1.4826 * np.median(np.abs(z - a @ x))
    return plane[3] < 0.25


@njit(cache=True, nogil=True)
def _meet(left: FloatArray, right: FloatArray, length: float, ends: FloatArray) -> bool:
    """Where both planes have one height, metres to the left at start and end."""
    fall = right[2] - left[2]
    ends[0] = (left[0] - right[0]) / fall
    ends[1] = (left[0] - right[0] + (left[1] - right[1]) * length) / fall
    return abs(ends[0]) < AWAY_M and abs(ends[1]) < AWAY_M


@njit(cache=True, nogil=True)
def _part(near: FloatArray, planes: tuple[FloatArray, FloatArray], how: tuple[float, float], ends: FloatArray) -> bool:
    """The line that parts the points of both planes best; of many as good ones their mean."""
    left, right = planes
    length, widest = how
    n = len(near)
    t, u, own = np.empty(n), np.empty(n), np.empty(n)
    count = 0
    gap = left[0] - right[0] + 0.5 * length * (left[1] - right[1])
    upper, lower, sign = (left, right, 1.0) if gap > 0 else (right, left, -1.0)
    for k in range(n):
        side = _belongs(near[k], upper, lower, abs(gap) > DEEP_M)
        if side != 0:
            t[count], u[count], own[count] = near[k, 0], near[k, 1], sign * side
            count += 1
    if count < 2 * LEAST_POINTS:
        return False
    fewest, total, sum_at, sum_turn = count, 0, 0.0, 0.0
    for k in range(ANGLES):
        angle = widest * (2 * k / (ANGLES - 1) - 1)
        turned = u[:count] - (t[:count] - 0.5 * length) * np.tan(angle)
        order = np.argsort(turned)
        wrong = int(np.sum(own[:count] < 0))  # all points left of the line: those of the right plane are wrong
        for j in range(count - 1):
            wrong += 1 if own[order[j]] > 0 else -1
            if wrong > fewest:
                continue
            at = 0.5 * (turned[order[j]] + turned[order[j + 1]])
            if wrong < fewest:
                fewest, total, sum_at, sum_turn = wrong, 0, 0.0, 0.0
            total, sum_at, sum_turn = total + 1, sum_at + at, sum_turn + np.tan(angle)
    if total == 0 or fewest > (1 - PARTED) * count:
        return False
    at, slant = sum_at / total, sum_turn / total
    ends[0], ends[1] = at - 0.5 * length * slant, at + 0.5 * length * slant
    return abs(ends[0]) < AWAY_M + 0.3 and abs(ends[1]) < AWAY_M + 0.3


@njit(cache=True, nogil=True)
def _wall(near: FloatArray, planes: tuple[FloatArray, FloatArray], length: float, ends: FloatArray) -> bool:
    """A line through the points that rise above both planes, where they follow one another along most of the way."""
    left, right = planes
    n = len(near)
    t, u = np.empty(n), np.empty(n)
    count = 0
    bins = max(int(length / STRIDE_M), 2)
    met = np.zeros(bins)
    for k in range(n):
        if abs(near[k, 1]) > 0.7:
            continue
        above = near[k, 2] - max(
            left[0] + left[1] * near[k, 0] + left[2] * near[k, 1],
            right[0] + right[1] * near[k, 0] + right[2] * near[k, 1],
        )
        if WALL_M < above < 1.5:
            t[count], u[count] = near[k, 0], near[k, 1]
            met[min(max(int(near[k, 0] / length * bins), 0), bins - 1)] = 1
            count += 1
    if count < LEAST_POINTS or np.mean(met) < 0.7:
        return False
    centre_t, centre_u = np.mean(t[:count]), np.mean(u[:count])
    spread = np.sum((t[:count] - centre_t) ** 2)
    slant = np.sum((t[:count] - centre_t) * (u[:count] - centre_u)) / max(spread, 1e-9)
    rest = u[:count] - centre_u - slant * (t[:count] - centre_t)
    ends[0], ends[1] = centre_u - slant * centre_t, centre_u + slant * (length - centre_t)
    return np.std(rest) < 0.3


@njit(cache=True, nogil=True)
def _stretch(points: FloatArray, result: FloatArray, near: FloatArray) -> None:
    """Takes the line back, or on, to where the points of both sides leave their planes."""
    line = np.array([result[X0], result[Y0], result[X1], result[Y1]])
    ax, ay, length = _axes(line)
    if length > LONGEST_M:
        return
    around = np.array(
        [line[0] - LONGEST_M * ax, line[1] - LONGEST_M * ay, line[2] + LONGEST_M * ax, line[3] + LONGEST_M * ay]
    )
    near = near[: _beside(points, around, near)]
    near[:, 0] -= LONGEST_M
    inside = near[(near[:, 0] > -0.2) & (near[:, 0] < length + 0.2)]
    left, right = np.zeros(4), np.zeros(4)
    if not _planes(inside, 0.5 * BESIDE_M, left, right):
        result[KIND] = NONE
        return
    gap = left[0] - right[0] + 0.5 * length * (left[1] - right[1])
    first, last = int(-LONGEST_M / STRIDE_M), int((LONGEST_M + length) / STRIDE_M) + 1
    holds = np.zeros(last - first + 1)
    for side in range(2):
        plane, sign = (left, 1.0) if side == 0 else (right, -1.0)
        good, all_of = np.zeros(len(holds)), np.zeros(len(holds))
        for k in range(len(near)):
            if not 0.1 < near[k, 1] * sign < 1.2:
                continue
            at = int(np.floor(near[k, 0] / STRIDE_M)) - first
            if 0 <= at < len(holds):
                all_of[at] += 1
                off = near[k, 2] - plane[0] - plane[1] * near[k, 0] - plane[2] * near[k, 1]
                fits = abs(off) < max(1.5 * FITTING_M, 3 * plane[3])
                if gap * sign < -DEEP_M:  # the lower side of a high step need not be even
                    other = right if side == 0 else left
                    fits = near[k, 2] - other[0] - other[1] * near[k, 0] - other[2] * near[k, 1] < -0.5 * DEEP_M
                good[at] += 1 if fits else 0
        for at in range(len(holds)):
            a, b = max(at - 1, 0), min(at + 2, len(holds))
            holds[at] += 1 if np.sum(good[a:b]) >= max(2.0, 0.75 * np.sum(all_of[a:b])) and good[at] > 0 else 0
    begin, end = _run(holds, max(-first, 0), min(int(length / STRIDE_M) - first, len(holds) - 1))
    if end < begin:
        result[KIND] = NONE
        return
    t0, t1 = (begin + first) * STRIDE_M, (end + 1 + first) * STRIDE_M
    rise = (result[Z1] - result[Z0]) / length
    result[Z0], result[Z1] = result[Z0] + rise * t0, result[Z0] + rise * t1
    result[X0], result[Y0] = line[0] + t0 * ax, line[1] + t0 * ay
    result[X1], result[Y1] = line[0] + t1 * ax, line[1] + t1 * ay


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
