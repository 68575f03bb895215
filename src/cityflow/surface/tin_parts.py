"""Divides a TIN into surfaces that ISO 19107 admits: one fan of triangles around every vertex, connected surfaces."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import VERTEX_DECIMALS

SHORTEST_M = 1.5e-3
"""Vertices nearer than 1 mm count as the same place."""
ASIDE_M = 2e-3
"""Where two parts of a TIN touch in a vertex only, each gets one of its own, so far inside of it: beyond what counts as the same place."""


def without_pinches(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The same TIN with a vertex of its own for every fan of triangles; (V, 3) world metres and (T, 3) as they come."""
    if not len(triangles):
        return vertices, triangles
    fans = _fans(triangles)
    first = np.unique(fans, return_index=True)[1]
    of_fan = triangles.reshape(-1)[first]
    if len(np.unique(of_fan)) == len(of_fan):
        return vertices, triangles
    fans_at = np.bincount(of_fan, minlength=len(vertices))
    numbers, made = np.where(fans_at[of_fan] > 1, -1, of_fan), [vertices]
    for fan in np.flatnonzero(numbers < 0):
        numbers[fan] = len(vertices) + len(made) - 1
        made.append(_aside(vertices, triangles[np.flatnonzero((fans == fan).reshape(-1, 3).any(axis=1))], of_fan[fan]))
    used, again = np.unique(numbers[fans], return_inverse=True)
    return np.concatenate(made)[used], again.reshape(-1, 3).astype(np.int64)


def without_short_edges(xy: FloatArray, triangles: IntArray, rank: IntArray) -> IntArray:
    """(T, 3) triangles left when vertices that all but coincide, as crossings of lines with lines do, have become one: that of the lower rank.

    Parameters
    ----------
    xy : (V, 2) world metres;  triangles : (T, 3), counter-clockwise
    rank : (V,) of two vertices the one with the lower rank stays
    """
    left = triangles
    for a, b in _short_edges(xy, triangles):
        keep, drop = (a, b) if (rank[a], a) <= (rank[b], b) else (b, a)
        moved = np.where(left == drop, keep, left)
        gone = (moved[:, :, None] == moved[:, None, :]).sum(axis=(1, 2)) > 3
        changed = (left == drop).any(axis=1) & ~gone
        # a triangle turned over is worse than a short edge
        if (_areas(xy, moved[changed]) > 0).all():
            left = moved[~gone]
    return left


def _short_edges(xy: FloatArray, triangles: IntArray) -> IntArray:
    edges = np.unique(np.sort(np.concatenate([triangles[:, [k, k - 1]] for k in range(3)]), axis=1), axis=0)
    return edges[np.hypot(*(xy[edges[:, 0]] - xy[edges[:, 1]]).T) < SHORTEST_M]


def _areas(xy: FloatArray, triangles: IntArray) -> FloatArray:
    a, b, c = (xy[triangles[:, k]] for k in range(3))
    (x, y), (p, q) = (b - a).T, (c - a).T
    return np.asarray((x * q - y * p) / 2)


def connected_parts(vertices: FloatArray, triangles: IntArray) -> list[tuple[FloatArray, IntArray]]:
    """Vertices and triangles of each part that hangs together, in the order of their first triangles."""
    if not len(triangles):
        return []
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    label = _labels(edges, len(vertices))[triangles[:, 0]]
    _, first = np.unique(label, return_index=True)
    parts = []
    for k in label[np.sort(first)]:
        used, numbers = np.unique(triangles[label == k], return_inverse=True)
        parts.append((vertices[used], numbers.reshape(-1, 3).astype(np.int64)))
    return parts


def _fans(triangles: IntArray) -> IntArray:
    """(3 T,) number of the fan that each corner of each triangle is in: corners at one vertex whose triangles hang together by edges there."""
    corner = np.arange(triangles.size).reshape(-1, 3)
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    at_start, at_end = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    swap = start > end
    low, high = np.where(swap, at_end, at_start), np.where(swap, at_start, at_end)
    order = np.lexsort((np.maximum(start, end), np.minimum(start, end)))
    one, two = order[:-1], order[1:]
    same = (np.minimum(start, end)[one] == np.minimum(start, end)[two]) & (
        np.maximum(start, end)[one] == np.maximum(start, end)[two]
    )
    one, two = one[same], two[same]
    pairs = np.concatenate([np.column_stack([side[one], side[two]]) for side in (low, high)])
    return _labels(pairs, triangles.size)


def _aside(vertices: FloatArray, fan: IntArray, vertex: int) -> FloatArray:
    """(1, 3) the vertex, moved into its fan of triangles, (n, 3), at its height."""
    place = vertices[vertex]
    way = vertices[fan][:, :, :2].mean(axis=(0, 1)) - place[:2]
    xy = place[:2] + ASIDE_M * way / np.hypot(*way)
    return np.array([[*xy.round(VERTEX_DECIMALS), place[2]]])


def _labels(pairs: IntArray, count: int) -> IntArray:
    """(count,) number of the group that each of `count` things is in, where pairs (n, 2) hang together."""
    links = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)
