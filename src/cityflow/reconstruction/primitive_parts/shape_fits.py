"""Roof shapes of few numbers, fitted to the few points of a part.

A shape over a box is z = e + s·t, where t (metres, in plan) is the shape's own: nothing for a flat roof, the way across for a shed, the way from
the ridge for a gable, the least way to any side for a hip. So a fit has two numbers, and two points make a guess. What a fit costs is in nats:
r² / 2σ² for a point, cut off where it lies on no roof, and a price for each number.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.planes.plane_labels import OUTLIER

FLAT, SHED, GABLE, HIP, PLANE = range(5)
KINDS = 10
"""Flat, sheds and gables across either axis, gables with a ridge off the middle, hip, free plane: the choice among them costs its logarithm."""
RIDGES = np.array([-0.2, -0.12, 0.12, 0.2])
"""Places of a ridge off the middle, in widths of the part; set by hand."""
MOST_GUESSES = 90
"""Starts that a robust fit is tried from; bounds time."""
LEAST_SLOPE, LEAST_RIDGED, MOST_SLOPE = 0.04, 0.14, 3.0
"""Rise over run of the flattest shed, of the flattest roof with a ridge, and of the steepest roof; set by hand."""
BEYOND_M = 1.0
"""A shape may run so far below and above all points of the unit; set by hand."""


class ShapeFit(NamedTuple):
    """A shape over a part.

    Attributes
    ----------
    cost : nats, of points and numbers
    kind, axis : `FLAT` … ; 0: it falls along u, 1: along v
    e, s : metres and rise over run: z = e + s·t;  q : slope across the axis of a free plane
    ridge : metres along the axis, of the ridge
    numbers : how many of them are free
    """

    cost: float
    kind: int
    axis: int
    e: float
    s: float
    q: float
    ridge: float
    numbers: int


@njit(cache=True, nogil=True)
def _cost(t: FloatArray, z: FloatArray, e: float, s: float, sigma: float, most: float) -> float:
    """Nats of all points, or more than `most`."""
    scale = 1.0 / ((1.0 + s * s) * 2.0 * sigma * sigma)
    total = 0.0
    for i in range(len(t)):
        r = z[i] - e - s * t[i]
        total += min(r * r * scale, OUTLIER)
        if total > most:
            break
    return total


@njit(cache=True, nogil=True)
def _refined(
    t: FloatArray, z: FloatArray, e: float, s: float, cost: float, sigma: float, level: bool
) -> tuple[float, float, float]:
    """Least squares over the points near the fit, as long as that lowers the cost."""
    for _ in range(6):
        n, st, sz, tt, tz = 0, 0.0, 0.0, 0.0, 0.0
        reach = 3.0 * sigma * math.sqrt(1.0 + s * s)
        for i in range(len(t)):
            if abs(z[i] - e - s * t[i]) <= reach:
                n += 1
                st += t[i]
                sz += z[i]
                tt += t[i] * t[i]
                tz += t[i] * z[i]
        if n == 0:
            break
        below = tt - st * st / n
        s1 = s if level or n < 2 or below < 1e-6 else (tz - st * sz / n) / below
        e1 = (sz - s1 * st) / n
        other = _cost(t, z, e1, s1, sigma, cost)
        if other >= cost - 1e-9:
            break
        cost, e, s = other, e1, s1
    return cost, e, s


@njit(cache=True, nogil=True)
def fit_level(z: FloatArray, sigma: float) -> tuple[float, float]:
    """Nats of points (heights, metres) on the best level roof, and its height."""
    t = np.zeros(len(z))
    best, at = OUTLIER * len(z) + 1.0, 0.0
    step = max(1, len(z) // MOST_GUESSES)
    for i in range(0, len(z), step):
        cost = _cost(t, z, z[i], 0.0, sigma, best)
        if cost < best:
            best, at = cost, z[i]
    best, at, _ = _refined(t, z, at, 0.0, best, sigma, True)
    return best, at


@njit(cache=True, nogil=True)
def _fit_slope(t: FloatArray, z: FloatArray, sigma: float, least: float, signed: bool) -> tuple[float, float, float]:
    """Best e and s; `signed`: only s of at least `least` (metres per metre), else |s|."""
    n = len(t)
    best, e, s = OUTLIER * n + 1.0, 0.0, 0.0
    order = np.argsort(t)
    spread = t[order[n - 1]] - t[order[0]]
    if n < 3 or spread < 0.8:
        return best, e, s
    all_pairs = n * (n - 1) // 2
    stride = max(1, all_pairs // MOST_GUESSES)
    count = 0
    for gap in range(max(1, n // 5), n):
        for i in range(n - gap):
            count += 1
            if count % stride != 0:
                continue
            a, b = order[i], order[i + gap]
            run = t[b] - t[a]
            if run < 0.25 * spread:
                continue
            slope = (z[b] - z[a]) / run
            if (slope < least) if signed else (abs(slope) < least):
                continue
            if abs(slope) > MOST_SLOPE:
                continue
            height = z[a] - slope * t[a]
            cost = _cost(t, z, height, slope, sigma, best)
            if cost < best:
                best, e, s = cost, height, slope
    if best <= OUTLIER * n:
        best, e, s = _refined(t, z, e, s, best, sigma, False)
    return best, e, s


@njit(cache=True, nogil=True)
def _within(e: float, s: float, low: float, high: float, limits: tuple[float, float]) -> bool:
    first, last = e + s * low, e + s * high
    return min(first, last) >= limits[0] and max(first, last) <= limits[1]


@njit(cache=True, nogil=True)
def fit_part(
    uv: FloatArray, z: FloatArray, box: FloatArray, limits: tuple[float, float], sigma: float, number: float
) -> ShapeFit:
    """The cheapest shape of a part.

    Parameters
    ----------
    uv : (N, 2) float64, places of the points in the frame of the outline;  z : (N,) float64, metres
    box : (4,) float64, u_min, v_min, u_max, v_max of the part
    limits : metres, lowest and highest that a shape may reach
    sigma : metres, how far points of one roof scatter across it
    number : nats that each number of a shape costs
    """
    n = len(z)
    choice = math.log(KINDS)
    cost, e = fit_level(z, sigma)
    best = ShapeFit(cost + choice + number, FLAT, 0, e, 0.0, 0.0, 0.0, 1)
    if n < 3:
        return best
    for axis in range(2):
        w = uv[:, axis].copy()
        low, high = box[axis], box[2 + axis]
        middle, width = (low + high) / 2, high - low
        cost, e, s = _fit_slope(w - middle, z, sigma, LEAST_SLOPE, False)
        if _within(e, s, -width / 2, width / 2, limits):
            total = cost + choice + 2 * number
            if total < best.cost:
                best = ShapeFit(total, SHED, axis, e, s, 0.0, middle, 2)
            shed = ShapeFit(cost, SHED, axis, e, s, 0.0, middle, 2)
            best = _free_plane((uv, z, box), shed, limits, sigma, choice + 3 * number, best)
        if width < 2.0:
            continue
        for k in range(-1, len(RIDGES)):
            ridge = middle if k < 0 else middle + RIDGES[k] * width
            numbers = 2 if k < 0 else 3
            if choice + numbers * number >= best.cost:
                continue
            cost, e, s = _fit_slope(-np.abs(w - ridge), z, sigma, LEAST_RIDGED, True)
            total = cost + choice + numbers * number
            if total < best.cost and _within(e, s, -max(high - ridge, ridge - low), 0.0, limits):
                best = ShapeFit(total, GABLE, axis, e, s, 0.0, ridge, numbers)
    width, length = box[2] - box[0], box[3] - box[1]
    if min(width, length) >= 3.0 and choice + 2 * number < best.cost:
        t = np.minimum(
            np.minimum(uv[:, 0] - box[0], box[2] - uv[:, 0]), np.minimum(uv[:, 1] - box[1], box[3] - uv[:, 1])
        )
        cost, e, s = _fit_slope(t, z, sigma, LEAST_RIDGED, True)
        if cost + choice + 2 * number < best.cost and _within(e, s, 0.0, min(width, length) / 2, limits):
            best = ShapeFit(cost + choice + 2 * number, HIP, 0, e, s, 0.0, 0.0, 2)
    return best


@njit(cache=True, nogil=True)
def _free_plane(
    part: tuple[FloatArray, FloatArray, FloatArray],
    shed: ShapeFit,
    limits: tuple[float, float],
    sigma: float,
    price: float,
    best: ShapeFit,
) -> ShapeFit:
    """The shed (its cost that of the points alone) turned a little, where that is cheaper: three numbers."""
    uv, z, box = part
    axis, e, s = shed.axis, shed.e, shed.s
    n = len(z)
    if n < 6 or shed.cost > 0.7 * OUTLIER * n or price >= best.cost:
        return best
    middle = (box[axis] + box[2 + axis]) / 2
    across = (box[1 - axis] + box[3 - axis]) / 2
    q = 0.0
    for _ in range(6):
        m = np.zeros((3, 3))
        y = np.zeros(3)
        reach = 4.0 * sigma * math.sqrt(1.0 + s * s + q * q)
        count = 0
        for i in range(n):
            t, r = uv[i, axis] - middle, uv[i, 1 - axis] - across
            if abs(z[i] - e - s * t - q * r) > reach:
                continue
            count += 1
            row = (1.0, t, r)
            for a in range(3):
                y[a] += row[a] * z[i]
                for b in range(3):
                    m[a, b] += row[a] * row[b]
        if count < 5 or np.linalg.det(m) < 1e-3 * count:
            return best
        x = np.linalg.solve(m, y)
        e, s, q = x[0], x[1], x[2]
    total = price
    for i in range(n):
        r = z[i] - e - s * (uv[i, axis] - middle) - q * (uv[i, 1 - axis] - across)
        total += min(r * r / ((1.0 + s * s + q * q) * 2.0 * sigma * sigma), OUTLIER)
    half, wide = (box[2 + axis] - box[axis]) / 2, (box[3 - axis] - box[1 - axis]) / 2
    swing = abs(s) * half + abs(q) * wide
    if total < best.cost and e - swing >= limits[0] and e + swing <= limits[1] and math.hypot(s, q) <= MOST_SLOPE:
        return ShapeFit(total, PLANE, axis, e, s, q, middle, 3)
    return best


def planes_of(fit: ShapeFit, box: FloatArray) -> FloatArray:
    """(P, 3) a, b, c of z = a·u + b·v + c: the planes whose lower envelope the shape is."""
    middle = (box[:2] + box[2:]) / 2

    def along(axis: int, slope: float, at: float, height: float) -> list[float]:
        gradient = [0.0, 0.0]
        gradient[axis] = slope
        return [*gradient, height - slope * at]

    if fit.kind == FLAT:
        return np.array([[0.0, 0.0, fit.e]])
    if fit.kind == SHED:
        return np.array([along(fit.axis, fit.s, fit.ridge, fit.e)])
    if fit.kind == PLANE:
        a, b, c = along(fit.axis, fit.s, fit.ridge, fit.e)
        gradient = [a, b]
        gradient[1 - fit.axis] = fit.q
        return np.array([[*gradient, c - fit.q * middle[1 - fit.axis]]])
    if fit.kind == GABLE:
        return np.array([along(fit.axis, s, fit.ridge, fit.e) for s in (fit.s, -fit.s)])
    return np.array(
        [along(axis, sign * fit.s, box[axis + 2 * (sign < 0)], fit.e) for axis in (0, 1) for sign in (1, -1)]
    )
