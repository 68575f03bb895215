"""A path along a wall split into straight and bent parts: the cheapest explanation of its sections.

Sections are half a metre of path with the median of the points that stand there. A part costs a fixed price and, for each section, the square of
how far it lies off the part's line or arc, up to a limit: so a balcony is not worth a part of its own, a step between two houses is. The cheapest
sequence of parts is found by dynamic programming.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

ARC_SECTIONS = 6
"""An arc through fewer sections says nothing that a line does not."""


@dataclass(frozen=True, slots=True)
class Prices:
    """What parts cost, in squares of `tolerance`.

    Attributes
    ----------
    tolerance : metres, how far a section's middle strays for no reason
    line, arc : of a part
    most : a section costs no more, however far off it is
    longest_arc : sections; longer ones turn too far for one chord
    """

    tolerance: float
    line: float = 10.0
    arc: float = 16.0
    most: float = 6.0
    longest_arc: int = 200


@dataclass(frozen=True, slots=True)
class Part:
    """Sections `first` to `last`, both included, follow a line or an arc."""

    first: int
    last: int
    curved: bool


def parts(middle: FloatArray, prices: Prices) -> list[Part]:
    """Cheapest parts of a sequence of sections.

    Parameters
    ----------
    middle : (M, 2) points in plan, one after the other, metres; near the origin
    """
    before, curved = _cheapest(
        np.ascontiguousarray(middle - middle.mean(axis=0)),
        prices.tolerance,
        (prices.line, prices.arc, prices.most),
        prices.longest_arc,
    )
    found, end = [], len(middle)
    while end > 0:
        found.append(Part(int(before[end]), end - 1, bool(curved[end])))
        end = int(before[end])
    return found[::-1]


@njit(cache=True, nogil=True)
def _cheapest(
    middle: FloatArray, tolerance: float, price: tuple[float, float, float], longest: int
) -> tuple[IntArray, IntArray]:
    n = len(middle)
    cost = np.full(n + 1, np.inf)
    cost[0] = 0.0
    before, curved = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    for end in range(1, n + 1):
        for begin in range(end - 1, -1, -1):
            if cost[begin] + price[0] >= cost[end]:
                continue
            part = middle[begin:end]
            line = _line_cost(part, tolerance, price[2])
            if cost[begin] + price[0] + line < cost[end]:
                cost[end], before[end], curved[end] = cost[begin] + price[0] + line, begin, 0
            if (
                ARC_SECTIONS <= end - begin <= longest
                and line > price[1] - price[0]
                and cost[begin] + price[1] < cost[end]
            ):
                arc = _arc_cost(part, tolerance, price[2])
                if cost[begin] + price[1] + arc < cost[end]:
                    cost[end], before[end], curved[end] = cost[begin] + price[1] + arc, begin, 1
    return before, curved


@njit(cache=True, nogil=True)
def _line_cost(part: FloatArray, tolerance: float, most: float) -> float:
    if len(part) < 3:
        return 0.0
    weight = np.ones(len(part))
    nx, ny, c = 0.0, 0.0, 0.0
    for _ in range(3):
        w, x, y, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(len(part)):
            w += weight[k]
            x += weight[k] * part[k, 0]
            y += weight[k] * part[k, 1]
        x, y = x / w, y / w
        for k in range(len(part)):
            dx, dy = part[k, 0] - x, part[k, 1] - y
            xx += weight[k] * dx * dx
            xy += weight[k] * dx * dy
            yy += weight[k] * dy * dy
        angle = 0.5 * np.arctan2(2 * xy, xx - yy)
        nx, ny = -np.sin(angle), np.cos(angle)
        c = nx * x + ny * y
        for k in range(len(part)):
            weight[k] = 1.0 / max(abs(nx * part[k, 0] + ny * part[k, 1] - c) / tolerance, 1.0)
    total = 0.0
    for k in range(len(part)):
        total += min(((nx * part[k, 0] + ny * part[k, 1] - c) / tolerance) ** 2, most)
    return total


@njit(cache=True, nogil=True)
def _arc_cost(part: FloatArray, tolerance: float, most: float) -> float:
    """As for a line, of the circle ``v + b·u + c + a·(u² + v²) = 0`` in a frame along the chord; infinite beyond a half circle."""
    n = len(part)
    dx, dy = part[n - 1, 0] - part[0, 0], part[n - 1, 1] - part[0, 1]
    length = np.hypot(dx, dy)
    if length < 1e-6:
        return np.inf
    dx, dy = dx / length, dy / length
    mx, my = part[:, 0].mean(), part[:, 1].mean()
    a, b, c = 0.0, 0.0, 0.0
    weight = np.ones(n)
    u = (part[:, 0] - mx) * dx + (part[:, 1] - my) * dy
    v = (part[:, 1] - my) * dx - (part[:, 0] - mx) * dy
    total = np.inf
    for _ in range(3):
        matrix, right = np.zeros((3, 3)), np.zeros(3)
        for k in range(n):
            row = (u[k] * u[k] + v[k] * v[k], u[k], 1.0)
            slope = (b + 2 * a * u[k]) ** 2 + (1 + 2 * a * v[k]) ** 2
            w = weight[k] / max(slope, 1e-9)
            for i in range(3):
                right[i] -= w * row[i] * v[k]
                for j in range(3):
                    matrix[i, j] += w * row[i] * row[j]
        for i in range(3):
            matrix[i, i] += 1e-9
        a, b, c = np.linalg.solve(matrix, right)
        whole = np.sqrt(max(1.0 + b * b - 4.0 * a * c, 1e-12))
        total = 0.0
        for k in range(n):
            value = v[k] + b * u[k] + c + a * (u[k] * u[k] + v[k] * v[k])
            d = abs(2.0 * value / (whole + np.sqrt(max(whole * whole + 4.0 * a * value, 0.0)))) / tolerance
            total += min(d * d, most)
            weight[k] = 1.0 / max(d, 1.0)
    # the chord of more than a half circle is no axis to count along
    if abs(a) * length > 0.9 * whole:
        return np.inf
    return total
