"""A closed solid less some prisms and with others added: an exact Boolean, its faces put together again with their semantics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import manifold3d
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import VERTEX_DECIMALS, Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_normals, triangulate
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.solids.corner_faces import CornerFace, leaves_line, numbered
from cityflow.reconstruction.solids.ring_tracing import group_rings, trace_rings
from cityflow.reconstruction.solids.wall_merging import Corner

STRAIGHT_M = 5e-4
"""A corner of two faces only that lies this near to the line between its neighbours is left out; rounding."""
SAME_PLACE_M = 1e-6
"""A vertex so near to one of the solid as it was is that vertex; rounding."""
LEAST_AREA_M2 = 1e-9
"""A face of less has no plane."""
SAME_PLANE = 3
"""Decimals of normals and offsets (m) of planes that are one."""
LEVEL = 0.5
"""A face whose normal rises more than this is level."""


class Prism(NamedTuple):
    """Upright sides over a polygon (plan, world metres) between two world heights."""

    polygon: Polygon
    low: float
    high: float


class _Key(NamedTuple):
    """What triangles of one face have in common: the face that they are a part of, or the plane and the kind of a prism's."""

    semantic: Semantic
    plane: int
    face: int
    place: tuple[float, ...]


def carve(solid: Polyhedron, voids: Sequence[Prism], bodies: Sequence[Prism]) -> Polyhedron | None:
    """The solid without the voids and with the bodies; None where nothing is left. It may break rules: the caller checks.

    Vertices of the solid stay bit for bit, others are whole tenths of a millimetre. Faces of prisms have `points` of 0, to be counted.
    """
    origin = np.floor(solid.vertices.min(axis=0))
    sources: dict[int, tuple[_Key, ...]] = {}
    made = _meshed(solid, origin, sources, _own_keys(solid))
    if voids:
        hollow = [_prism(prism, origin, sources, Semantic.OUTER_FLOOR, -1.0) for prism in voids]
        made -= manifold3d.Manifold.batch_boolean(hollow, manifold3d.OpType.Add)
    for prism in bodies:
        made += _prism(prism, origin, sources, Semantic.ROOF, 1.0)
    if made.status() != manifold3d.Error.NoError or made.num_tri() == 0:
        return None
    mesh = made.to_mesh64()
    run = np.repeat(np.asarray(mesh.run_original_id), np.diff(np.asarray(mesh.run_index)) // 3)
    keys = [sources[int(r)][int(f)] for r, f in zip(run, mesh.face_id, strict=True)]
    triangles = np.asarray(mesh.tri_verts, np.int64)
    return _faced(_world(np.asarray(mesh.vert_properties)[:, :3], origin, solid), triangles, keys, solid)


def _own_keys(solid: Polyhedron) -> list[_Key]:
    return [_Key(f.semantic, f.plane, k, ()) for k, f in enumerate(solid.faces)]


def _prism(
    prism: Prism, origin: FloatArray, sources: dict[int, tuple[_Key, ...]], upper: Semantic, side: float
) -> manifold3d.Manifold:
    """`side` is −1 for what is taken away: its faces are seen from within."""
    body = extrude(prism.polygon, prism.low, prism.high)
    keys = []
    for normal, face in zip(side * face_normals(body), body.faces, strict=True):
        kind = upper if normal[2] > LEVEL else Semantic.OUTER_CEILING if normal[2] < -LEVEL else Semantic.WALL
        offset = float(normal @ (body.vertices[face.rings[0][0]] - origin))
        keys.append(_Key(kind, -1, -1, tuple(np.round([*normal, offset], SAME_PLANE) + 0.0)))
    return _meshed(body, origin, sources, keys)


def _meshed(
    solid: Polyhedron, origin: FloatArray, sources: dict[int, tuple[_Key, ...]], keys: Sequence[_Key]
) -> manifold3d.Manifold:
    """Each triangle has a number of its own, so that none of its vertices is taken for superfluous."""
    mesh, number = triangulate(solid), manifold3d.Manifold.reserve_ids(1)
    made = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(mesh.vertices - origin),
            mesh.triangles.astype(np.uint64),
            run_index=np.array([0, 3 * len(mesh.triangles)], np.uint64),
            run_original_id=np.array([number], np.uint32),
            face_id=np.arange(len(mesh.triangles), dtype=np.uint64),
        )
    )
    sources[number] = tuple(keys[int(f)] for f in mesh.faces)
    return made


def _world(local: FloatArray, origin: FloatArray, solid: Polyhedron) -> FloatArray:
    world = np.round(local + origin, VERTEX_DECIMALS)
    apart = np.abs((solid.vertices - origin)[None] - local[:, None]).max(axis=2)
    nearest = np.argmin(apart, axis=1)
    own = apart[np.arange(len(local)), nearest] <= SAME_PLACE_M
    world[own] = solid.vertices[nearest[own]]
    return np.asarray(world)


def _faced(world: FloatArray, triangles: IntArray, keys: Sequence[_Key], solid: Polyhedron) -> Polyhedron:
    """Triangles of one key that meet along edges become a face."""
    kept, index = np.unique(world, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[triangles]
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles, keys = triangles[whole], [key for key, is_whole in zip(keys, whole, strict=True) if is_whole]
    order = {key: k for k, key in enumerate(sorted(set(keys)))}
    number = np.array([order[key] for key in keys])
    faces: list[CornerFace] = []
    new: list[bool] = []
    for key, k in order.items():
        for part in _connected(triangles[number == k]):
            faces += [CornerFace(rings, key.semantic, key.plane) for rings in _rings(part, kept)]
        new += [key.face < 0] * (len(faces) - len(new))
    first = {tuple(v) for v in solid.vertices.tolist()}

    def is_needed(corner: Corner, around: set[Corner]) -> bool:
        place = tuple(kept[corner[0]].tolist())
        return (
            place in first
            or len(around) != 2
            or leaves_line(place, [tuple(kept[c[0]]) for c in sorted(around)], STRAIGHT_M)
        )

    made = numbered(faces, lambda corner: tuple(kept[corner[0]].tolist()), is_needed)
    flagged = (replace(f, points=0) if is_new else f for f, is_new in zip(made.faces, new, strict=True))
    return Polyhedron(made.vertices, tuple(flagged))


def _connected(triangles: IntArray) -> list[IntArray]:
    """Groups of triangles that share edges, each once."""
    owner: dict[tuple[int, int], int] = {}
    pairs = []
    for t, (a, b, c) in enumerate(triangles.tolist()):
        for u, v in ((a, b), (b, c), (c, a)):
            owner[u, v] = t
    pairs = [(t, owner[v, u]) for (u, v), t in owner.items() if (v, u) in owner]
    links = np.array(pairs, np.int64).reshape(-1, 2)
    size = (len(triangles), len(triangles))
    count, label = connected_components(coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=size), False)
    return [triangles[label == k] for k in range(count)]


def _rings(triangles: IntArray, vertices: FloatArray) -> list[tuple[tuple[Corner, ...], ...]]:
    """Exterior and holes of one plane part, seen from outside."""
    edges = [(t[k], t[(k + 1) % 3]) for t in triangles.tolist() for k in range(3)]
    inside = set(edges)
    border = [(u, v) for u, v in edges if (v, u) not in inside]
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a).sum(axis=0)
    size = float(np.linalg.norm(normal))
    if size < LEAST_AREA_M2 or Counter(u for u, _ in border) != Counter(v for _, v in border):
        return []
    normal /= size
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    used = np.unique(triangles)
    flat = np.zeros((len(vertices), 2))
    flat[used] = (vertices[used] - vertices[used[0]]) @ np.column_stack([u, np.cross(normal, u)])
    xy = [(float(x), float(y)) for x, y in flat]
    return [tuple(tuple((v, 0) for v in ring) for ring in part) for part in group_rings(trace_rings(border, xy), xy)]
