"""Triangles in a tree of boxes, for ray intersection tests."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit

LEAF = 4
"""Triangles of a leaf; no result depends on it."""
DEEPEST = 64
"""Of the stack: the tree of any scene in memory is less deep."""
PARALLEL = 1e-14
"""Determinant of a ray along a triangle; rounding."""
RIM = 1e-9
"""Triangles are wider by this share, so that no ray slips between neighbours."""


class TriangleTree(NamedTuple):
    """A tree over triangles, for compiled code.

    Attributes
    ----------
    corners : (T, 3, 3) a corner and the edges to the two others, in the order of the leaves
    boxes : (N, 6) lower and upper corner of each node
    nodes : (N, 2) first child (the second follows it) and 0, or the first triangle of a leaf and how many it has
    """

    corners: FloatArray
    boxes: FloatArray
    nodes: IntArray


def triangle_tree(corners: FloatArray) -> TriangleTree:
    """The tree of (T, 3, 3) corners of triangles."""
    if not len(corners):
        return TriangleTree(np.empty((0, 3, 3)), np.empty((0, 6)), np.empty((0, 2), np.int64))
    corners = np.ascontiguousarray(corners, np.float64)
    order, boxes, nodes = _build(corners.min(axis=1), corners.max(axis=1))
    kept = corners[order]
    kept[:, 1:] -= kept[:, :1]
    return TriangleTree(kept, boxes, nodes)


@njit(cache=True, nogil=True)
def _build(low, high):  # type: ignore[no-untyped-def]
    """Halves by the median of the boxes' middles along the longest side."""
    count = low.shape[0]
    order = np.arange(count)
    boxes, nodes = np.empty((2 * count + 1, 6)), np.zeros((2 * count + 1, 2), np.int64)
    first, last = np.zeros(2 * count + 1, np.int64), np.zeros(2 * count + 1, np.int64)
    last[0] = count
    made, at = 1, 0
    while at < made:
        a, b = first[at], last[at]
        for k in range(3):
            boxes[at, k], boxes[at, 3 + k] = low[order[a], k], high[order[a], k]
            for i in range(a + 1, b):
                boxes[at, k] = min(boxes[at, k], low[order[i], k])
                boxes[at, 3 + k] = max(boxes[at, 3 + k], high[order[i], k])
        if b - a <= LEAF:
            nodes[at, 0], nodes[at, 1] = a, b - a
        else:
            axis = int(np.argmax(boxes[at, 3:] - boxes[at, :3]))
            part = order[a:b].copy()
            middles = np.empty(b - a)
            for i in range(b - a):
                middles[i] = low[part[i], axis] + high[part[i], axis]
            order[a:b] = part[np.argsort(middles, kind="mergesort")]
            half = (a + b) // 2
            nodes[at, 0] = made
            first[made], last[made], first[made + 1], last[made + 1] = a, half, half, b
            made += 2
        at += 1
    return order, boxes[:made], nodes[:made]


@njit(cache=True, nogil=True)
def meets_triangle(tree, p, d, length, guess):  # type: ignore[no-untyped-def]
    """A triangle that the ray from p (3,) along the unit vector d (3,) meets within `length`, or -1; `guess` is tried first."""
    if tree.nodes.shape[0] == 0:
        return -1
    if guess >= 0 and _hits(tree.corners[guess], p, d, length):
        return guess
    stack = np.empty(DEEPEST, np.int64)
    stack[0], depth = 0, 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if not _enters(tree.boxes[node], p, d, length):
            continue
        if tree.nodes[node, 1] == 0:
            stack[depth], stack[depth + 1] = tree.nodes[node, 0], tree.nodes[node, 0] + 1
            depth += 2
            continue
        for i in range(tree.nodes[node, 0], tree.nodes[node, 0] + tree.nodes[node, 1]):
            if _hits(tree.corners[i], p, d, length):
                return i
    return -1


@njit(cache=True, nogil=True, inline="always")
def _enters(box, p, d, length):  # type: ignore[no-untyped-def]
    near, far = 0.0, length
    for k in range(3):
        if abs(d[k]) < 1e-300:
            if p[k] < box[k] or p[k] > box[3 + k]:
                return False
            continue
        one, two = (box[k] - p[k]) / d[k], (box[3 + k] - p[k]) / d[k]
        near, far = max(near, min(one, two)), min(far, max(one, two))
    return near <= far * (1.0 + 1e-12) + 1e-9


@njit(cache=True, nogil=True, inline="always")
def _hits(triangle, p, d, length):  # type: ignore[no-untyped-def]
    """After Möller and Trumbore, from both sides."""
    e, f = triangle[1], triangle[2]
    hx, hy, hz = d[1] * f[2] - d[2] * f[1], d[2] * f[0] - d[0] * f[2], d[0] * f[1] - d[1] * f[0]
    det = e[0] * hx + e[1] * hy + e[2] * hz
    if abs(det) < PARALLEL:
        return False
    sx, sy, sz = p[0] - triangle[0, 0], p[1] - triangle[0, 1], p[2] - triangle[0, 2]
    u = (sx * hx + sy * hy + sz * hz) / det
    if u < -RIM or u > 1.0 + RIM:
        return False
    qx, qy, qz = sy * e[2] - sz * e[1], sz * e[0] - sx * e[2], sx * e[1] - sy * e[0]
    v = (d[0] * qx + d[1] * qy + d[2] * qz) / det
    if v < -RIM or u + v > 1.0 + RIM:
        return False
    t = (f[0] * qx + f[1] * qy + f[2] * qz) / det
    return 0.0 <= t < length
