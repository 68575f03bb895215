"""Measures of polyhedra: areas, normals, planes, volume, bounds, triangles.

All sums run in a frame whose origin is the first vertex, so that national coordinates cost no digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron
from cityflow.geometry.polygon_triangulation import triangulate_faces
from cityflow.geometry.recent import remembered


@dataclass(frozen=True, slots=True)
class FaceArrays:
    """The faces of a polyhedron as flat arrays.

    Attributes
    ----------
    vertices : (V, 3) float64, metres, local: the first vertex is the origin
    origin : (3,) float64, world position of the local origin
    corners : (C,) int64, vertex of each ring corner, ring after ring
    ring_start : (R + 1,) int64, where each ring begins in `corners`
    face_start : (F + 1,) int64, where each face begins among the rings; its first ring is the exterior
    """

    vertices: FloatArray
    origin: FloatArray
    corners: IntArray
    ring_start: IntArray
    face_start: IntArray

    @property
    def face_count(self) -> int:
        return len(self.face_start) - 1

    @property
    def ring_of_corner(self) -> IntArray:
        return np.repeat(np.arange(len(self.ring_start) - 1), np.diff(self.ring_start))

    @property
    def face_of_ring(self) -> IntArray:
        return np.repeat(np.arange(self.face_count), np.diff(self.face_start))

    def next_corner(self) -> IntArray:
        """(C,) position in `corners` of the corner after each, around its ring."""
        following = np.arange(1, len(self.corners) + 1)
        filled = np.diff(self.ring_start) > 0
        following[self.ring_start[1:][filled] - 1] = self.ring_start[:-1][filled]
        return following


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles of a polyhedron.

    Attributes
    ----------
    vertices : (V, 3) float64, world metres: those of the polyhedron
    triangles : (T, 3) int64, counter-clockwise seen from outside
    faces : (T,) int64, the face that each triangle is a part of
    """

    vertices: FloatArray
    triangles: IntArray
    faces: IntArray


@remembered
def face_arrays(polyhedron: Polyhedron) -> FaceArrays:
    """Flat arrays of the faces, in their order."""
    rings = [ring for face in polyhedron.faces for ring in face.rings]
    sizes = [len(ring) for ring in rings]
    corners = np.fromiter(chain.from_iterable(rings), np.int64, sum(sizes))
    vertices = np.asarray(polyhedron.vertices, np.float64).reshape(-1, 3)
    origin = vertices[0].copy() if len(vertices) else np.zeros(3)
    return FaceArrays(
        vertices - origin, origin, corners, _starts(sizes), _starts([len(f.rings) for f in polyhedron.faces])
    )


def rings_of(polyhedron: Polyhedron) -> list[list[FloatArray]]:
    """(n, 3) rings of each face, exterior first."""
    return [[polyhedron.ring(ring) for ring in face.rings] for face in polyhedron.faces]


def arrays_of_rings(polygons: Sequence[Sequence[FloatArray]]) -> FaceArrays:
    """Flat arrays of polygons that share no vertex list: rings of each, (n, 3) world metres, without the repeated last point."""
    rings = [np.asarray(ring, np.float64).reshape(-1, 3) for polygon in polygons for ring in polygon]
    points = np.concatenate([np.empty((0, 3)), *rings])
    origin = points[0].copy() if len(points) else np.zeros(3)
    starts = _starts([len(ring) for ring in rings]), _starts([len(polygon) for polygon in polygons])
    return FaceArrays(points - origin, origin, np.arange(len(points)), *starts)


def ring_area_vectors(arrays: FaceArrays) -> FloatArray:
    """(R, 3) area vectors of the rings after Newell: normal direction times area, m²."""
    here = arrays.vertices[arrays.corners]
    first = here[np.repeat(arrays.ring_start[:-1], np.diff(arrays.ring_start))]
    there = arrays.vertices[arrays.corners[arrays.next_corner()]]
    return _sum_by(_cross(here - first, there - first) / 2, arrays.ring_start)


@remembered
def face_area_vectors(polyhedron: Polyhedron) -> FloatArray:
    """(F, 3) area vectors of the faces, holes taken off: outward normal times area, m²."""
    arrays = face_arrays(polyhedron)
    return _sum_by(ring_area_vectors(arrays), arrays.face_start)


def face_areas(polyhedron: Polyhedron) -> FloatArray:
    """(F,) areas of the faces, m²."""
    return np.asarray(np.linalg.norm(face_area_vectors(polyhedron), axis=1))


@remembered
def face_normals(polyhedron: Polyhedron) -> FloatArray:
    """(F, 3) outward unit normals after Newell; NaN for faces without area."""
    vectors = face_area_vectors(polyhedron)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, lengths, out=np.full_like(vectors, np.nan), where=lengths > 0)


def face_plane(polyhedron: Polyhedron, face: int) -> tuple[FloatArray, float]:
    """Outward unit normal n (3,) and offset d, metres, of the plane n·p = d through the mean vertex of a face."""
    normal = face_normals(polyhedron)[face]
    used = [i for ring in polyhedron.faces[face].rings for i in ring]
    return normal, float(normal @ polyhedron.vertices[used].mean(axis=0))


def volume(polyhedron: Polyhedron) -> float:
    """Volume, m³: positive where the faces' normals point outwards.

    Each face stands for the fan from its mean vertex, which is exact for planar faces.
    """
    arrays = face_arrays(polyhedron)
    if not len(arrays.corners):
        return 0.0
    here, there = arrays.vertices[arrays.corners], arrays.vertices[arrays.corners[arrays.next_corner()]]
    face_of_corner = arrays.face_of_ring[arrays.ring_of_corner]
    corner_start = arrays.ring_start[arrays.face_start]
    counts = np.maximum(np.diff(corner_start), 1)
    apex = (_sum_by(here, corner_start) / counts[:, None])[face_of_corner]
    return float(np.einsum("ij,ij->", apex, _cross(here, there)) / 6)


def bounds_3d(polyhedron: Polyhedron) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner, (3,) each, world metres, of the vertices that faces use."""
    used = polyhedron.vertices[face_arrays(polyhedron).corners]
    return used.min(axis=0), used.max(axis=0)


@remembered
def triangulate(polyhedron: Polyhedron) -> Mesh:
    """Constrained Delaunay triangles of every face; they use every corner, collinear ones too, so neighbours fit."""
    arrays = face_arrays(polyhedron)
    triangles, faces = mesh_of(arrays)
    return Mesh(np.asarray(polyhedron.vertices, np.float64), triangles, faces)


@remembered
def mesh_of(arrays: FaceArrays) -> tuple[IntArray, IntArray]:
    """(T, 3) triangles and (T,) faces of flat arrays; see `triangulate`."""
    if not len(arrays.corners):
        return np.empty((0, 3), np.int64), np.empty(0, np.int64)
    xy = project(arrays, projection_normals(arrays))
    corner_triangles, faces = triangulate_faces(xy, arrays.ring_start, arrays.face_start)
    return arrays.corners[corner_triangles], faces


@remembered
def projection_normals(arrays: FaceArrays) -> FloatArray:
    """(F, 3) unit normals to project each face along: of its exterior ring after Newell, else of least variance.

    Newell's is the direction of greatest area; rings that cancel themselves (a bow tie) have none.
    """
    exterior = ring_area_vectors(arrays)[np.minimum(arrays.face_start[:-1], len(arrays.ring_start) - 2)]
    lengths = np.linalg.norm(exterior, axis=1)
    flat_normals, extent = _least_variance(arrays)
    weak = lengths <= 1e-6 * extent**2
    normals = np.where(weak[:, None], flat_normals, exterior)
    norms = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, norms, out=np.tile([0.0, 0.0, 1.0], (len(normals), 1)), where=norms > 0)


def plane_distances(arrays: FaceArrays) -> FloatArray:
    """(C,) distance, metres, of each corner from the least-squares plane of all corners of its face."""
    normals, _ = _least_variance(arrays)
    offsets = arrays.vertices[arrays.corners] - _means(arrays)[_face_of_corner(arrays)]
    return np.abs(np.einsum("ij,ij->i", offsets, normals[_face_of_corner(arrays)]))


@remembered
def project(arrays: FaceArrays, normals: FloatArray) -> FloatArray:
    """(C, 2) corners in the plane of their face, metres, seen against its normal (counter-clockwise stays so)."""
    axes_u = _cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    axes_u /= np.linalg.norm(axes_u, axis=1, keepdims=True)
    axes_v = _cross(normals, axes_u)
    of_corner = _face_of_corner(arrays)
    points = arrays.vertices[arrays.corners] - _means(arrays)[of_corner]
    return np.column_stack(
        [np.einsum("ij,ij->i", points, axes_u[of_corner]), np.einsum("ij,ij->i", points, axes_v[of_corner])]
    )


@remembered
def _face_of_corner(arrays: FaceArrays) -> IntArray:
    return np.repeat(np.arange(arrays.face_count), np.diff(arrays.ring_start[arrays.face_start]))


@remembered
def _means(arrays: FaceArrays) -> FloatArray:
    corner_start = arrays.ring_start[arrays.face_start]
    counts = np.maximum(np.diff(corner_start), 1)[:, None]
    return _sum_by(arrays.vertices[arrays.corners], corner_start) / counts


@remembered
def _least_variance(arrays: FaceArrays) -> tuple[FloatArray, FloatArray]:
    """(F, 3) directions of least variance of the faces' corners, and (F,) their greatest standard deviation."""
    corner_start = arrays.ring_start[arrays.face_start]
    offsets = arrays.vertices[arrays.corners] - _means(arrays)[_face_of_corner(arrays)]
    products = (offsets[:, :, None] * offsets[:, None, :]).reshape(-1, 9)
    counts = np.maximum(np.diff(corner_start), 1)[:, None]
    values, directions = np.linalg.eigh((_sum_by(products, corner_start) / counts).reshape(-1, 3, 3))
    return directions[:, :, 0], np.sqrt(np.maximum(values[:, 2], 0))


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N, 3) cross products, without what numpy asks of its arguments first."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.column_stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _starts(sizes: list[int]) -> IntArray:
    return np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes, dtype=np.int64)])


def _sum_by(values: FloatArray, start: IntArray) -> FloatArray:
    """Sums of consecutive rows; runs may be empty."""
    total = np.zeros((len(start) - 1, values.shape[1]))
    filled = np.diff(start) > 0
    if np.any(filled):
        total[filled] = np.add.reduceat(values, start[:-1][filled], axis=0)
    return total
