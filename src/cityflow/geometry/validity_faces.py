"""Rules of rings and polygons, checked in the plane of each face with a tolerance for touching."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.geometry.validity_rings import APART, distance_to_edge, hole_faults, relation_of_edges


@njit(cache=True, nogil=True)
def snap(vertices: FloatArray, tolerance: float) -> IntArray:
    """(V,) for each vertex the first one, in order, that lies within the tolerance (m) and stands for itself."""
    n = len(vertices)
    representative, kept, count = np.empty(n, np.int64), np.empty(n, np.int64), 0
    for i in range(n):
        representative[i] = i
        for k in range(count):
            j = kept[k]
            dx = vertices[i, 0] - vertices[j, 0]
            dy = vertices[i, 1] - vertices[j, 1]
            dz = vertices[i, 2] - vertices[j, 2]
            if dx * dx + dy * dy + dz * dz <= tolerance * tolerance:
                representative[i] = j
                break
        if representative[i] == i:
            kept[count] = i
            count += 1
    return representative


@njit(cache=True, nogil=True)
def inspect_faces(
    xy: FloatArray,
    corners: IntArray,
    ring_start: IntArray,
    face_start: IntArray,
    off_plane: FloatArray,
    limits: FloatArray,
) -> list[tuple[int, int, int]]:
    """Faults of rings and polygons.

    Parameters
    ----------
    xy : (C, 2) corners in the plane of their face, metres;  corners : (C,) their vertices, snapped
    ring_start, face_start : where rings and faces begin, as in `FaceArrays`
    off_plane : (C,) metres from the face's plane
    limits : planarity and touch tolerance, metres

    Returns
    -------
    code, face, ring within the face (−1: the face as a whole); of each face only its lowest level of faults
    """
    faults = [(0, 0, 0) for _ in range(0)]
    for f in range(len(face_start) - 1):
        starts = ring_start[face_start[f] : face_start[f + 1] + 1]
        for code, ring in _face_faults(xy, corners, starts, off_plane, limits):
            faults.append((code, f, ring))
    return faults


@njit(cache=True, nogil=True)
def _face_faults(
    xy: FloatArray, corners: IntArray, starts: IntArray, off_plane: FloatArray, limits: FloatArray
) -> list[tuple[int, int]]:
    faults = [(0, 0) for _ in range(0)]
    rings = len(starts) - 1
    for r in range(rings):
        code = _repeated_corner(corners[starts[r] : starts[r + 1]])
        if code > 0:
            faults.append((code, r))
    if len(faults) > 0:
        return faults
    if off_plane[starts[0] : starts[rings]].max() > limits[0]:
        faults.append((203, -1))
        return faults
    for r in range(rings):
        if _crosses_itself(xy[starts[r] : starts[r + 1]], corners[starts[r] : starts[r + 1]], limits[1]):
            faults.append((104, r))
    if len(faults) > 0 or rings == 1:
        return faults
    return hole_faults(xy, corners, starts, limits[1])


@njit(cache=True, nogil=True)
def _repeated_corner(ring: IntArray) -> int:
    """101 or 102 for a ring of vertex indices, else 0."""
    n = len(ring)
    if n < 3:
        return 101
    for i in range(n):
        if ring[i] == ring[i - 1]:
            return 102
    return 0


@njit(cache=True, nogil=True)
def _crosses_itself(xy: FloatArray, ring: IntArray, touch: float) -> bool:
    """True where a ring crosses or touches itself, or turns back on itself."""
    n = len(xy)
    box = np.empty((n, 4))
    for i in range(n):
        a, b, c = xy[i - 1], xy[i], xy[(i + 1) % n]
        if distance_to_edge(c, a, b) <= touch or distance_to_edge(a, b, c) <= touch:
            return True
        box[i, 0], box[i, 1] = min(b[0], c[0]) - touch, max(b[0], c[0])
        box[i, 2], box[i, 3] = min(b[1], c[1]) - touch, max(b[1], c[1])
    for i in range(n):
        for j in range(i + 2, n - (i == 0)):
            if box[i, 0] > box[j, 1] or box[j, 0] > box[i, 1] or box[i, 2] > box[j, 3] or box[j, 2] > box[i, 3]:
                continue
            if ring[i] == ring[j] or relation_of_edges(xy[i], xy[i + 1], xy[j], xy[(j + 1) % n], touch)[0] != APART:
                return True
    return False


@njit(cache=True, nogil=True)
def normal_turns(vertices: FloatArray, triangles: IntArray, faces: IntArray, face_count: int) -> FloatArray:
    """(F,) degrees, the largest angle between normals of two triangles of a face, those without area apart."""
    count = len(triangles)
    normals = np.zeros((count, 3))
    for t in range(count):
        a, b, c = vertices[triangles[t, 0]], vertices[triangles[t, 1]], vertices[triangles[t, 2]]
        ux, uy, uz, vx, vy, vz = b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = np.sqrt(x * x + y * y + z * z)
        if length > 1e-12:
            normals[t, 0], normals[t, 1], normals[t, 2] = x / length, y / length, z / length
    turns = np.zeros(face_count)
    for t in range(count):
        cosine = 1.0
        for s in range(t - 1, -1, -1):
            if faces[s] != faces[t]:
                break
            dot = normals[t, 0] * normals[s, 0] + normals[t, 1] * normals[s, 1] + normals[t, 2] * normals[s, 2]
            if dot < cosine and normals[t].any() and normals[s].any():
                cosine = dot
        turns[faces[t]] = max(turns[faces[t]], np.degrees(np.arccos(max(cosine, -1.0))))
    return turns
