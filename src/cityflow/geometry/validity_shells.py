"""Rules of shells that need no coordinates: closed, 2-manifold, in one piece, all faces turned alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.kernels import njit
from cityflow.geometry.faults import Fault
from cityflow.geometry.polyhedron import FaceArrays


def topology_faults(arrays: FaceArrays, triangles: IntArray, closed: bool = True) -> list[Fault]:
    """Faults 301, 302, 303, 305 and 307 of a shell of sound faces; an open surface may have a border, and any number of faces.

    Parameters
    ----------
    arrays : faces with snapped corners
    triangles : (T, 3) their triangles
    """
    if closed and arrays.face_count < 4:
        return [Fault.of(301)]
    edges = _edges(arrays)
    faults = [f for f in _edge_faults(edges) if closed or f.code != 302]
    if faults:
        return faults
    faces, turned = _pairs(edges)
    against = _turned_faces(faces, turned, arrays.face_count)
    faults = [Fault.of(307, f"face={f}") for f in np.flatnonzero(against)]
    if faults:
        return faults
    if np.any(turned):
        return [Fault.of(307)]
    vertex_count = len(arrays.vertices)
    faults = [Fault.of(303, f"vertex={v}") for v in np.flatnonzero(_fans(triangles, vertex_count) > 1)]
    if _component_count(triangles, vertex_count) > 1:
        faults.append(Fault.of(305))
    return faults


class ShellEdges(NamedTuple):
    """Edges of all faces, (E,) each, the same edge side by side: key (lower vertex · V + upper), face, whether it runs upwards."""

    key: IntArray
    face: IntArray
    upwards: BoolArray


def _edges(arrays: FaceArrays) -> ShellEdges:
    here, there = arrays.corners, arrays.corners[arrays.next_corner()]
    key = np.minimum(here, there) * len(arrays.vertices) + np.maximum(here, there)
    order = np.argsort(key, kind="stable")
    face = arrays.face_of_ring[arrays.ring_of_corner]
    return ShellEdges(key[order], face[order], (here < there)[order])


def _edge_faults(edges: ShellEdges) -> list[Fault]:
    _, first, count = np.unique(edges.key, return_index=True, return_counts=True)
    faults = []
    for code, chosen in ((302, count == 1), (303, count > 2)):
        for begin, size in zip(first[chosen], count[chosen], strict=True):
            faces = "|".join(f"face={f}" for f in edges.face[begin : begin + size])
            faults.append(Fault.of(code, faces))
    return sorted(set(faults))


def _pairs(edges: ShellEdges) -> tuple[IntArray, BoolArray]:
    """(E, 2) faces on both sides of each edge that has two, and (E,) whether both run along it in the same direction."""
    first = np.flatnonzero(edges.key[:-1] == edges.key[1:])
    faces = np.column_stack([edges.face[first], edges.face[first + 1]])
    return faces, edges.upwards[first] == edges.upwards[first + 1]


@njit(cache=True, nogil=True)
def _turned_faces(faces: IntArray, turned: BoolArray, face_count: int) -> BoolArray:
    """(F,) the faces of each connected part that are turned against its majority."""
    parent, flip = np.arange(face_count), np.zeros(face_count, np.bool_)
    for e in range(len(faces)):
        a, b = faces[e, 0], faces[e, 1]
        odd = turned[e]
        while parent[a] != a:
            odd ^= flip[a]
            a = parent[a]
        while parent[b] != b:
            odd ^= flip[b]
            b = parent[b]
        if a != b:
            parent[b], flip[b] = a, odd
    root, side = np.empty(face_count, np.int64), np.zeros(face_count, np.bool_)
    votes = np.zeros((face_count, 2), np.int64)
    for f in range(face_count):
        at = f
        while parent[at] != at:
            side[f] ^= flip[at]
            at = parent[at]
        root[f] = at
        votes[at, int(side[f])] += 1
    against = np.zeros(face_count, np.bool_)
    for f in range(face_count):
        minority = votes[root[f], 1] <= votes[root[f], 0]
        against[f] = side[f] == minority
    return against


@njit(cache=True, nogil=True)
def _root(parent: IntArray, at: int) -> int:
    while parent[at] != at:
        parent[at] = parent[parent[at]]
        at = parent[at]
    return at


@njit(cache=True, nogil=True)
def _fans(triangles: IntArray, vertex_count: int) -> IntArray:
    """(V,) number of fans of triangles around each vertex that hang together by edges; more than 1 is no umbrella."""
    count = len(triangles)
    parent = np.arange(3 * count)
    keys = np.empty(3 * count, np.int64)
    for t in range(count):
        for e in range(3):
            u, v = triangles[t, e], triangles[t, (e + 1) % 3]
            keys[3 * t + e] = min(u, v) * vertex_count + max(u, v)
    order = np.argsort(keys, kind="mergesort")
    for k in range(1, 3 * count):
        if keys[order[k]] != keys[order[k - 1]]:
            continue
        a, b = order[k - 1], order[k]
        t, e, s, g = a // 3, a % 3, b // 3, b % 3
        for i in (e, (e + 1) % 3):
            for j in (g, (g + 1) % 3):
                if triangles[t, i] == triangles[s, j]:
                    parent[_root(parent, 3 * t + i)] = _root(parent, 3 * s + j)
    fans = np.zeros(vertex_count, np.int64)
    for k in range(3 * count):
        if parent[k] == k:
            fans[triangles[k // 3, k % 3]] += 1
    return fans


@njit(cache=True, nogil=True)
def _component_count(triangles: IntArray, vertex_count: int) -> int:
    """Number of parts of a shell that have no vertex in common."""
    parent = np.arange(vertex_count)
    for t in range(len(triangles)):
        for e in range(2):
            parent[_root(parent, triangles[t, e])] = _root(parent, triangles[t, e + 1])
    roots = np.zeros(vertex_count, np.bool_)
    for t in range(len(triangles)):
        roots[_root(parent, triangles[t, 0])] = True
    return int(roots.sum())
