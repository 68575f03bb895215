"""Where faces of a shell meet otherwise than in the edges and vertices they share.

Broad phase: triangles sorted along the longest axis, then overlap of bounding boxes. Narrow phase by the number of
vertices that two triangles share: with none any contact counts; with one the two edges opposite it are held against
the other triangle; with two only folding onto each other is left. Distances decide, so that the verdict does not hang
on the last digit of coordinates or on how the model is turned.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

Point = tuple[float, float, float]
Flags = tuple[bool, bool, bool]


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
    order = np.argsort(lower[:, axis].copy(), kind="mergesort")
    normals = _normals(vertices, triangles)
    found = [(0, 0) for _ in range(0)]
    for m in range(len(order)):
        i = order[m]
        for n in range(m + 1, len(order)):
            j = order[n]
            if lower[j, axis] > upper[i, axis]:
                break
            if groups[i] == groups[j] or not _boxes_meet(lower, upper, i, j):
                continue
            if _pair_meets(vertices, triangles, normals, (i, j), touch):
                pair = (min(groups[i], groups[j]), max(groups[i], groups[j]))
                if pair not in found:
                    found.append(pair)
                if len(found) >= most:
                    return found
    return found


@njit(cache=True, nogil=True)
def _normals(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    normals = np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        a = _point(vertices, triangles[t, 0])
        b, c = _point(vertices, triangles[t, 1]), _point(vertices, triangles[t, 2])
        normals[t, 0], normals[t, 1], normals[t, 2] = _normal(a, b, c)
    return normals


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
    triangles = np.empty((2, 3), np.int64)
    triangles[0], triangles[1] = one, two
    return _pair_meets(vertices, triangles, _normals(vertices, triangles), (0, 1), touch)


@njit(cache=True, nogil=True)
def _pair_meets(
    vertices: FloatArray, triangles: IntArray, normals: FloatArray, pair: tuple[int, int], touch: float
) -> bool:
    one, two = triangles[pair[0]], triangles[pair[1]]
    shared, first, second = 0, (False, False, False), (False, False, False)
    for j in range(3):
        if two[j] == one[0] or two[j] == one[1] or two[j] == one[2]:
            shared += 1
    if shared >= 3:
        return True
    if shared > 0:
        first = (_has(two, one[0]), _has(two, one[1]), _has(two, one[2]))
        second = (_has(one, two[0]), _has(one, two[1]), _has(one, two[2]))
    a, b, c = _point(vertices, one[0]), _point(vertices, one[1]), _point(vertices, one[2])
    d, e, f = _point(vertices, two[0]), _point(vertices, two[1]), _point(vertices, two[2])
    if _apart(a, _point(normals, pair[0]), (d, e, f), second, touch):
        return False
    if _apart(d, _point(normals, pair[1]), (a, b, c), first, touch):
        return False
    if shared == 2:
        return _folded((a, b, c), (d, e, f), first, second)
    if shared == 0:
        n, m = _point(normals, pair[0]), _point(normals, pair[1])
        for u, v in ((a, b), (b, c), (c, a)):
            if _beside(d, e, u, v, n, touch) and _beside(f, f, u, v, n, touch):
                return False
        for u, v in ((d, e), (e, f), (f, d)):
            if _beside(a, b, u, v, m, touch) and _beside(c, c, u, v, m, touch):
                return False
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
def _has(triangle: IntArray, vertex: int) -> bool:
    return bool(triangle[0] == vertex or triangle[1] == vertex or triangle[2] == vertex)


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
def _apart(a: Point, n: Point, others: tuple[Point, Point, Point], shared: Flags, touch: float) -> bool:
    """True where the plane through a with unit normal n has all points that are not shared well on one side."""
    lowest, highest = np.inf, -np.inf
    for k in range(3):
        if not shared[k]:
            s = _dot(n, _minus(others[k], a))
            lowest, highest = min(lowest, s), max(highest, s)
    return lowest > touch or highest < -touch


@njit(cache=True, nogil=True)
def _folded(one: tuple[Point, Point, Point], two: tuple[Point, Point, Point], first: Flags, second: Flags) -> bool:
    """True where two triangles with a common edge, known to lie in one plane, lie on the same side of it."""
    i, j = 0, 0
    for k in range(3):
        if not first[k]:
            i = k
        if not second[k]:
            j = k
    u, v = one[(i + 1) % 3], one[(i + 2) % 3]
    edge = _minus(v, u)
    return _dot(_cross(edge, _minus(one[i], u)), _cross(edge, _minus(two[j], u))) > 0


@njit(cache=True, nogil=True)
def _segment_meets(p: Point, q: Point, a: Point, b: Point, c: Point, touch: float) -> bool:
    """True where a segment pierces a triangle or comes as close to it as `touch`."""
    n = _normal(a, b, c)
    sp, sq = _dot(n, _minus(p, a)), _dot(n, _minus(q, a))
    if min(sp, sq) > touch or max(sp, sq) < -touch:
        return False
    if _beside(p, q, a, b, n, touch) or _beside(p, q, b, c, n, touch) or _beside(p, q, c, a, n, touch):
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
def _beside(p: Point, q: Point, a: Point, b: Point, n: Point, touch: float) -> bool:
    """True where a segment lies as a whole beyond the edge a–b, by more than `touch`, of a triangle with normal n."""
    edge = _minus(b, a)
    inwards = _cross(n, edge)
    outer = max(_dot(inwards, _minus(p, a)), _dot(inwards, _minus(q, a)))
    return outer < 0 and outer * outer > touch * touch * _dot(edge, edge)


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
