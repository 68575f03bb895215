"""Where faces of a shell meet otherwise than in the edges and vertices they share.

Broad phase: triangles sorted along the longest axis, then overlap of bounding boxes. Narrow phase by the number of
vertices that two triangles share: with none any contact counts; with one the two edges opposite it are held against
the other triangle; with two only folding onto each other is left. Distances decide, so that the verdict does not hang
on the last digit of coordinates or on how the model is turned.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

Point = tuple[float, float, float]


@njit(cache=True, nogil=True)
def meeting_groups(
    vertices: FloatArray, triangles: IntArray, groups: IntArray, touch: float, most: int
) -> list[tuple[int, int]]:
    """Pairs of groups that cross, overlap or touch without sharing the place; the first `most` of them.

    Parameters
    ----------
    vertices : (V, 3) metres;  triangles : (T, 3)
    groups : (T,) the face, or shell, of each triangle; triangles of one group are not held against each other
    touch : distance, metres, at which they touch
    """
    lower, upper = _boxes(vertices, triangles, touch)
    axis = 0
    for k in range(1, 3):
        if upper[:, k].max() - lower[:, k].min() > upper[:, axis].max() - lower[:, axis].min():
            axis = k
    order = np.argsort(lower[:, axis], kind="mergesort")
    found = [(0, 0) for _ in range(0)]
    for m in range(len(order)):
        i = order[m]
        for n in range(m + 1, len(order)):
            j = order[n]
            if lower[j, axis] > upper[i, axis]:
                break
            if groups[i] == groups[j] or not _boxes_meet(lower, upper, i, j):
                continue
            if triangles_meet(vertices, triangles[i], triangles[j], touch):
                pair = (min(groups[i], groups[j]), max(groups[i], groups[j]))
                if pair not in found:
                    found.append(pair)
                if len(found) >= most:
                    return found
    return found


@njit(cache=True, nogil=True)
def _boxes(vertices: FloatArray, triangles: IntArray, touch: float) -> tuple[FloatArray, FloatArray]:
    lower, upper = np.empty((len(triangles), 3)), np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        for k in range(3):
            a, b, c = vertices[triangles[t, 0], k], vertices[triangles[t, 1], k], vertices[triangles[t, 2], k]
            lower[t, k], upper[t, k] = min(a, b, c) - touch, max(a, b, c) + touch
    return lower, upper


@njit(cache=True, nogil=True)
def _boxes_meet(lower: FloatArray, upper: FloatArray, i: int, j: int) -> bool:
    meet = True
    for k in range(3):
        meet &= lower[i, k] <= upper[j, k] and lower[j, k] <= upper[i, k]
    return meet


@njit(cache=True, nogil=True)
def triangles_meet(vertices: FloatArray, one: IntArray, two: IntArray, touch: float) -> bool:
    """True where two triangles, (3,) vertex indices each, have more in common than the vertices they share."""
    shared, first, second = 0, np.zeros(3, np.bool_), np.zeros(3, np.bool_)
    for i in range(3):
        for j in range(3):
            if one[i] == two[j]:
                first[i] = second[j] = True
                shared += 1
    if shared >= 3:
        return True
    a, b, c = _point(vertices, one[0]), _point(vertices, one[1]), _point(vertices, one[2])
    d, e, f = _point(vertices, two[0]), _point(vertices, two[1]), _point(vertices, two[2])
    if _apart(a, b, c, ((d, second[0]), (e, second[1]), (f, second[2])), touch):
        return False
    if _apart(d, e, f, ((a, first[0]), (b, first[1]), (c, first[2])), touch):
        return False
    if shared == 2:
        return _folded((a, b, c), (d, e, f), first, second)
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3
        if (shared == 0 or first[i]) and _segment_meets(
            _point(vertices, one[p]), _point(vertices, one[q]), d, e, f, touch
        ):
            return True
        if (shared == 0 or second[i]) and _segment_meets(
            _point(vertices, two[p]), _point(vertices, two[q]), a, b, c, touch
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def _point(vertices: FloatArray, i: int) -> Point:
    return vertices[i, 0], vertices[i, 1], vertices[i, 2]


@njit(cache=True, nogil=True)
def _minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True, nogil=True)
def _dot(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True)
def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, nogil=True)
def _normal(a: Point, b: Point, c: Point) -> Point:
    """Unit normal; zero for a triangle without area."""
    n = _cross(_minus(b, a), _minus(c, a))
    length = np.sqrt(_dot(n, n))
    if length < 1e-14:
        return 0.0, 0.0, 0.0
    return n[0] / length, n[1] / length, n[2] / length


@njit(cache=True, nogil=True)
def _apart(
    a: Point,
    b: Point,
    c: Point,
    others: tuple[tuple[Point, bool], tuple[Point, bool], tuple[Point, bool]],
    touch: float,
) -> bool:
    """True where the plane of a triangle has all vertices of the other that are not shared well on one side."""
    n = _normal(a, b, c)
    lowest, highest = np.inf, -np.inf
    for p, is_shared in others:
        if not is_shared:
            s = _dot(n, _minus(p, a))
            lowest, highest = min(lowest, s), max(highest, s)
    return lowest > touch or highest < -touch


@njit(cache=True, nogil=True)
def _folded(
    one: tuple[Point, Point, Point], two: tuple[Point, Point, Point], first: BoolArray, second: BoolArray
) -> bool:
    """True where two triangles with a common edge, known to lie in one plane, lie on the same side of it."""
    i, j = int(np.argmin(first)), int(np.argmin(second))
    apex, other = one[i], two[j]
    u, v = one[(i + 1) % 3], one[(i + 2) % 3]
    edge = _minus(v, u)
    return _dot(_cross(edge, _minus(apex, u)), _cross(edge, _minus(other, u))) > 0


@njit(cache=True, nogil=True)
def _segment_meets(p: Point, q: Point, a: Point, b: Point, c: Point, touch: float) -> bool:
    """True where a segment pierces a triangle or comes as close to it as `touch`."""
    n = _normal(a, b, c)
    sp, sq = _dot(n, _minus(p, a)), _dot(n, _minus(q, a))
    if min(sp, sq) > touch or max(sp, sq) < -touch:
        return False
    if sp * sq < 0:
        t = sp / (sp - sq)
        hit = (p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2]))
        if _over(hit, a, b, c, n):
            return True
    if (abs(sp) <= touch and _over(p, a, b, c, n)) or (abs(sq) <= touch and _over(q, a, b, c, n)):
        return True
    near = touch * touch
    return _gap(p, q, a, b) <= near or _gap(p, q, b, c) <= near or _gap(p, q, c, a) <= near


@njit(cache=True, nogil=True)
def _over(p: Point, a: Point, b: Point, c: Point, n: Point) -> bool:
    """True where the foot of a point lies in a triangle with unit normal n."""
    return (
        _dot(n, _cross(_minus(b, a), _minus(p, a))) >= 0
        and _dot(n, _cross(_minus(c, b), _minus(p, b))) >= 0
        and _dot(n, _cross(_minus(a, c), _minus(p, c))) >= 0
        and _dot(n, n) > 0
    )


@njit(cache=True, nogil=True)
def _gap(p: Point, q: Point, a: Point, b: Point) -> float:
    """Squared distance of two segments (Ericson, Real-Time Collision Detection, 5.1.9)."""
    d1, d2, r = _minus(q, p), _minus(b, a), _minus(p, a)
    aa, ee, f = _dot(d1, d1), _dot(d2, d2), _dot(d2, r)
    bb, cc = _dot(d1, d2), _dot(d1, r)
    if aa == 0 and ee == 0:
        return _dot(r, r)
    denominator = aa * ee - bb * bb
    s = min(max((bb * f - cc * ee) / denominator, 0.0), 1.0) if denominator > 1e-14 * aa * ee else 0.0
    t = (bb * s + f) / ee if ee > 0 else 0.0
    if t < 0 or ee == 0:
        t, s = 0.0, (min(max(-cc / aa, 0.0), 1.0) if aa > 0 else 0.0)
    elif t > 1:
        t, s = 1.0, (min(max((bb - cc) / aa, 0.0), 1.0) if aa > 0 else 0.0)
    gap = (r[0] + s * d1[0] - t * d2[0], r[1] + s * d1[1] - t * d2[1], r[2] + s * d1[2] - t * d2[2])
    return _dot(gap, gap)
