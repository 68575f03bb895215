"""Rings of one face against each other: holes within, apart, and joined in no chain."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit

APART, TOUCH, CROSS, OVERLAP = 0, 1, 2, 3
"""How two segments lie to each other."""


@njit(cache=True, nogil=True)
def distance_to_edge(p: FloatArray, a: FloatArray, b: FloatArray) -> float:
    """Distance of a point from a segment."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    t = 0.0
    if length > 0:
        t = min(max(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length, 0.0), 1.0)
    return float(np.hypot(a[0] + t * dx - p[0], a[1] + t * dy - p[1]))


@njit(cache=True, nogil=True)
def _offset(p: FloatArray, a: FloatArray, b: FloatArray) -> float:
    """Signed distance of a point from the line a–b, positive on its left."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = np.hypot(dx, dy)
    return float((dx * (p[1] - a[1]) - dy * (p[0] - a[0])) / length) if length > 0 else 0.0


@njit(cache=True, nogil=True)
def relation_of_edges(
    a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, touch: float
) -> tuple[int, float, float]:
    """How the segments a–b and c–d lie to each other, and the point where they touch."""
    if max(a[0], b[0]) < min(c[0], d[0]) - touch or max(c[0], d[0]) < min(a[0], b[0]) - touch:
        return APART, 0.0, 0.0
    if max(a[1], b[1]) < min(c[1], d[1]) - touch or max(c[1], d[1]) < min(a[1], b[1]) - touch:
        return APART, 0.0, 0.0
    sc, sd, sa, sb = _offset(c, a, b), _offset(d, a, b), _offset(a, c, d), _offset(b, c, d)
    if min(abs(sc), abs(sd), abs(sa), abs(sb)) > touch and sc * sd < 0 and sa * sb < 0:
        return CROSS, 0.0, 0.0
    relation, x, y = APART, 0.0, 0.0
    for p, u, v in ((a, c, d), (b, c, d), (c, a, b), (d, a, b)):
        if distance_to_edge(p, u, v) > touch:
            continue
        if relation == APART:
            relation, x, y = TOUCH, p[0], p[1]
        elif np.hypot(p[0] - x, p[1] - y) > 10 * touch:
            relation = OVERLAP
    return relation, x, y


@njit(cache=True, nogil=True)
def _area(xy: FloatArray) -> float:
    """Signed area of a ring, positive counter-clockwise."""
    total = 0.0
    for i in range(len(xy)):
        total += xy[i - 1, 0] * xy[i, 1] - xy[i, 0] * xy[i - 1, 1]
    return total / 2


@njit(cache=True, nogil=True)
def _side(p: FloatArray, ring: FloatArray, touch: float) -> int:
    """1 inside a ring, −1 outside, 0 on it within the tolerance."""
    inside = False
    for i in range(len(ring)):
        a, b = ring[i - 1], ring[i]
        if distance_to_edge(p, a, b) <= touch:
            return 0
        if (a[1] > p[1]) != (b[1] > p[1]) and p[0] < a[0] + (p[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1]):
            inside = not inside
    return 1 if inside else -1


@njit(cache=True, nogil=True)
def _sides(ring: FloatArray, other: FloatArray, touch: float) -> tuple[bool, bool]:
    """Whether corners or middles of edges of a ring lie inside the other, and outside of it."""
    within, without = False, False
    for i in range(len(ring)):
        for p in (ring[i], (ring[i - 1] + ring[i]) / 2):
            side = _side(p, other, touch)
            within, without = within or side > 0, without or side < 0
    return within, without


@njit(cache=True, nogil=True)
def _same_ring(a: IntArray, b: IntArray) -> bool:
    """True where two rings have the same vertices in the same or the reverse cyclic order."""
    n = len(a)
    if n != len(b):
        return False
    for start in range(n):
        for step in (1, -1):
            i = 0
            while i < n and a[i] == b[(start + step * i) % n]:
                i += 1
            if i == n:
                return True
    return False


@njit(cache=True, nogil=True)
def hole_faults(xy: FloatArray, corners: IntArray, starts: IntArray, touch: float) -> list[tuple[int, int]]:
    """Codes and rings of what is wrong between the rings of one face."""
    rings = len(starts) - 1
    faults = [(0, 0) for _ in range(0)]
    where = np.empty((4 * (rings + 1) * rings, 2))
    touched = np.zeros((len(where), rings), np.bool_)
    points, linked = 0, False
    for s in range(1, rings):
        for r in range(s):
            code, points = _ring_pair(xy, corners, starts, (r, s), touch, where, touched, points)
            if code > 0:
                faults.append((code, s))
    exterior = _area(xy[starts[0] : starts[1]])
    for s in range(1, rings):
        if _area(xy[starts[s] : starts[s + 1]]) * exterior > 0:
            faults.append((208, s))
    if len(faults) == 0:
        linked = _closes_a_chain(touched[:points])
    if linked:
        faults.append((205, -1))
    return faults


@njit(cache=True, nogil=True)
def _ring_pair(
    xy: FloatArray,
    corners: IntArray,
    starts: IntArray,
    pair: tuple[int, int],
    touch: float,
    where: FloatArray,
    touched: BoolArray,
    points: int,
) -> tuple[int, int]:
    """Fault of two rings (0: none) and the number of points noted where rings touch; ring 0 is the exterior."""
    r, s = pair
    one, two = xy[starts[r] : starts[r + 1]], xy[starts[s] : starts[s + 1]]
    if _same_ring(corners[starts[r] : starts[r + 1]], corners[starts[s] : starts[s + 1]]):
        return 202, points
    before = points
    for i in range(len(one)):
        for j in range(len(two)):
            relation, x, y = relation_of_edges(one[i - 1], one[i], two[j - 1], two[j], touch)
            if relation >= CROSS:
                return 201, points
            if relation == TOUCH:
                points = _note(where, touched, points, (x, y), pair, touch)
    within, without = _sides(two, one, touch)
    if within and without:
        return 201, points
    if r > 0:
        return 207 if within or _sides(one, two, touch)[0] else 0, points
    if without:
        return 201 if points > before else 206, points
    return 0, points


@njit(cache=True, nogil=True)
def _note(
    where: FloatArray,
    touched: BoolArray,
    points: int,
    at: tuple[float, float],
    pair: tuple[int, int],
    touch: float,
) -> int:
    """Note that two rings touch in a point; the number of distinct points so far."""
    k = 0
    while k < points and np.hypot(where[k, 0] - at[0], where[k, 1] - at[1]) > 10 * touch:
        k += 1
    if k == len(where):
        return points
    where[k, 0], where[k, 1] = at
    touched[k, pair[0]] = touched[k, pair[1]] = True
    return max(points, k + 1)


@njit(cache=True, nogil=True)
def _closes_a_chain(touched: BoolArray) -> bool:
    """True where touching rings enclose a part of the face: rings and points then form a cycle, else a forest."""
    points, rings = touched.shape
    parent = np.arange(points + rings)
    for p in range(points):
        for r in range(rings):
            if not touched[p, r]:
                continue
            a, b = p, points + r
            while parent[a] != a:
                a = parent[a]
            while parent[b] != b:
                b = parent[b]
            if a == b:
                return True
            parent[a] = b
    return False
