"""Constrained Delaunay triangulation of polygons with holes that keeps every vertex.

Ears are cut best shape first, then edges are flipped until the triangulation is Delaunay inside the polygon. Vertices
in the middle of straight edges stay: neighbours of a face refer to them, and dropping them would open cracks. The
flips leave no slivers beside such vertices.
"""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.geometry.flips import cross_product, flip_edges


def triangulate_polygon(rings: list[FloatArray]) -> IntArray:
    """(T, 3) triangles of one polygon.

    Parameters
    ----------
    rings : exterior, then holes, each (n, 2) metres without the repeated last point; exterior counter-clockwise and
        holes clockwise. The result counts corners through all rings.

    >>> triangulate_polygon([np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])]).tolist()
    [[2, 0, 1]]
    """
    ring_start = np.concatenate([[0], np.cumsum([len(r) for r in rings])]).astype(np.int64)
    triangles, _ = triangulate_faces(np.concatenate(rings), ring_start, np.array([0, len(rings)]))
    return triangles


@njit(cache=True, nogil=True)
def triangulate_faces(xy: FloatArray, ring_start: IntArray, face_start: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles of many polygons.

    Parameters
    ----------
    xy : (C, 2) corners of all rings, metres, each face in a plane of its own
    ring_start : (R + 1,) where rings begin in `xy`;  face_start : (F + 1,) where faces begin among rings

    Returns
    -------
    triangles : (T, 3) positions in `xy`;  faces : (T,) the face of each
    """
    most = len(xy) + 2 * len(ring_start)
    triangles, faces = np.empty((most, 3), np.int64), np.empty(most, np.int64)
    used = 0
    for f in range(len(face_start) - 1):
        loop = _one_loop(xy, ring_start, face_start[f], face_start[f + 1])
        found = _cut_ears(xy, loop)
        flip_edges(xy, found)
        for t in range(len(found)):
            triangles[used + t] = found[t]
            faces[used + t] = f
        used += len(found)
    return triangles[:used], faces[:used]


@njit(cache=True, nogil=True)
def _one_loop(xy: FloatArray, ring_start: IntArray, first: int, last: int) -> IntArray:
    """Corners of a face as one loop: every hole is joined to it by a bridge, those furthest to the right first."""
    if last <= first:
        return np.empty(0, np.int64)
    loop = np.arange(ring_start[first], ring_start[first + 1])
    holes = last - first - 1
    rightmost = np.empty(holes, np.int64)
    reach = np.empty(holes)
    for h in range(holes):
        begin, end = ring_start[first + 1 + h], ring_start[first + 2 + h]
        if end <= begin:
            rightmost[h], reach[h] = -1, np.inf
            continue
        rightmost[h] = begin + np.argmax(xy[begin:end, 0])
        reach[h] = -xy[rightmost[h], 0]
    for h in np.argsort(reach, kind="mergesort"):
        if rightmost[h] < 0:
            continue
        begin, end = ring_start[first + 1 + h], ring_start[first + 2 + h]
        at, start = _common_corner(xy, loop, begin, end)
        touching = at >= 0
        if not touching:
            at, start = _bridge(xy, loop, rightmost[h], ring_start[first + 1], ring_start[last]), rightmost[h]
        ring = np.empty(end - begin - 1 if touching else end - begin + 1, np.int64)
        for i in range(len(ring)):
            ring[i] = begin + (start - begin + i + touching) % (end - begin)
        loop = np.concatenate((loop[: at + 1], ring, loop[at:]))
    return loop


@njit(cache=True, nogil=True)
def _common_corner(xy: FloatArray, loop: IntArray, begin: int, end: int) -> tuple[int, int]:
    """Position in the loop, and corner, where a hole touches the loop from inside; (−1, −1) where it does not."""
    n = len(loop)
    for k in range(n):
        for i in range(begin, end):
            following = i + 1 if i + 1 < end else begin
            if _same(xy[loop[k]], xy[i]) and _in_cone(xy[loop[k - 1]], xy[i], xy[loop[(k + 1) % n]], xy[following]):
                return k, i
    return -1, -1


@njit(cache=True, nogil=True)
def _bridge(xy: FloatArray, loop: IntArray, corner: int, begin: int, end: int) -> int:
    """Position in the loop of the nearest corner right of a hole's rightmost corner that it sees (Eberly: one exists).

    Holes not yet joined end left of it, so only their corners on the very same abscissa can be in the way.
    """
    n = len(loop)
    distance = np.empty(n)
    for k in range(n):
        distance[k] = (xy[loop[k], 0] - xy[corner, 0]) ** 2 + (xy[loop[k], 1] - xy[corner, 1]) ** 2
    order = np.argsort(distance, kind="mergesort")
    m = xy[corner]
    for k in order:
        v = xy[loop[k]]
        if distance[k] == 0:
            return int(k)
        if v[0] < m[0] or not _in_cone(xy[loop[k - 1]], v, xy[loop[(k + 1) % n]], m):
            continue
        clear = True
        for i in range(n):
            if _blocks(xy[loop[i]], xy[loop[(i + 1) % n]], m, v):
                clear = False
                break
        for i in range(begin, end):
            if clear and _lies_within(xy[i], m, v):
                clear = False
        if clear:
            return int(k)
    return int(order[0])


@njit(cache=True, nogil=True)
def _lies_within(p: FloatArray, a: FloatArray, b: FloatArray) -> bool:
    """True where p lies on the segment between a and b but is neither."""
    length = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
    along = (p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1])
    return 1e-12 * length < along < (1 - 1e-12) * length and abs(cross_product(a, b, p)) <= 1e-12 * length


@njit(cache=True, nogil=True)
def _in_cone(before: FloatArray, at: FloatArray, after: FloatArray, p: FloatArray) -> bool:
    """True where p lies in the inner angle of a corner of a counter-clockwise loop."""
    if cross_product(before, at, after) > 0:
        return cross_product(at, p, before) > 0 and cross_product(p, at, after) > 0
    return not (cross_product(at, p, after) >= 0 and cross_product(p, at, before) >= 0)


@njit(cache=True, nogil=True)
def _blocks(a: FloatArray, b: FloatArray, m: FloatArray, v: FloatArray) -> bool:
    """True where the edge a–b crosses the bridge m–v, or a lies within it."""
    if _lies_within(a, m, v):
        return True
    return (cross_product(a, b, m) * cross_product(a, b, v) < 0) and (
        cross_product(m, v, a) * cross_product(m, v, b) < 0
    )


@njit(cache=True, nogil=True)
def _cut_ears(xy: FloatArray, loop: IntArray) -> IntArray:
    """(n − 2, 3) triangles of a counter-clockwise loop, the best-shaped ear first.

    Where rounding leaves no ear at all the best-shaped corner is cut all the same, so that the loop always ends.
    """
    n = len(loop)
    triangles = np.empty((max(n - 2, 0), 3), np.int64)
    before, after = np.arange(-1, n - 1), np.arange(1, n + 1)
    if n > 0:
        before[0], after[n - 1] = n - 1, 0
    shape, alive, blocker = np.empty(n), np.ones(n, np.bool_), np.full(n, -1)
    for i in range(n):
        shape[i] = _shape(xy[loop[before[i]]], xy[loop[i]], xy[loop[after[i]]])
    for t in range(n - 2):
        best = _best_ear(xy, loop, (before, after, blocker), alive, shape)
        b, a = before[best], after[best]
        triangles[t, 0], triangles[t, 1], triangles[t, 2] = loop[b], loop[best], loop[a]
        alive[best], shape[best] = False, -np.inf
        after[b], before[a] = a, b
        for i in (b, a):
            shape[i], blocker[i] = _shape(xy[loop[before[i]]], xy[loop[i]], xy[loop[after[i]]]), -1
    return triangles


@njit(cache=True, nogil=True)
def _best_ear(
    xy: FloatArray, loop: IntArray, links: tuple[IntArray, IntArray, IntArray], alive: BoolArray, shape: FloatArray
) -> int:
    """The best-shaped ear; of each corner that is none, the one in its way is noted until that one is cut."""
    before, after, blocker = links
    fallback = int(np.argmax(shape))
    tried = np.zeros(len(loop), np.bool_)
    while True:
        best = -1
        for i in range(len(loop)):
            waits = blocker[i] >= 0 and alive[blocker[i]]
            if shape[i] > 0 and not tried[i] and not waits and (best < 0 or shape[i] > shape[best]):
                best = i
        if best < 0:
            return fallback
        blocker[best] = _in_the_way(xy, loop, before, after, alive, best)
        if blocker[best] == -1:
            return best
        tried[best] = True


@njit(cache=True, nogil=True)
def _shape(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the area over the square of the longest edge: 0.87 for equilateral triangles, 0 or less for no ear."""
    longest = max(
        (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2,
        (c[0] - b[0]) ** 2 + (c[1] - b[1]) ** 2,
        (a[0] - c[0]) ** 2 + (a[1] - c[1]) ** 2,
    )
    return cross_product(a, b, c) / longest if longest > 0 else 0.0


@njit(cache=True, nogil=True)
def _in_the_way(xy: FloatArray, loop: IntArray, before: IntArray, after: IntArray, alive: BoolArray, at: int) -> int:
    """Another corner in the closed triangle at a corner, −1 where there is none.

    Corners in the place of one of its own (bridges, rings that touch) count where the loop runs on into the triangle; as
    that may change with their neighbours, −2 stands for them.
    """
    a, b, c = xy[loop[before[at]]], xy[loop[at]], xy[loop[after[at]]]
    for i in range(len(loop)):
        if not alive[i] or i == at or i == before[at] or i == after[at]:
            continue
        p, u, v = xy[loop[i]], xy[loop[before[i]]], xy[loop[after[i]]]
        if _same(p, a):
            blocked = _between(a, b, c, u) or _between(a, b, c, v)
        elif _same(p, b):
            blocked = _between(b, c, a, u) or _between(b, c, a, v)
        elif _same(p, c):
            blocked = _between(c, a, b, u) or _between(c, a, b, v)
        elif cross_product(a, b, p) >= 0 and cross_product(b, c, p) >= 0 and cross_product(c, a, p) >= 0:
            return i
        else:
            blocked = False
        if blocked:
            return -2
    return -1


@njit(cache=True, nogil=True)
def _between(at: FloatArray, b: FloatArray, c: FloatArray, p: FloatArray) -> bool:
    """True where p, seen from a corner, lies strictly between the directions to b and to c."""
    return bool(cross_product(at, b, p) > 0 and cross_product(at, p, c) > 0)


@njit(cache=True, nogil=True)
def _same(p: FloatArray, q: FloatArray) -> bool:
    return bool(p[0] == q[0] and p[1] == q[1])
