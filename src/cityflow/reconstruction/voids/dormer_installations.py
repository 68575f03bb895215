"""Dormers: small roofs that stand out of one sloped roof of the model on walls of their own. Part of the solid, they are installations at LoD 3 besides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Installation, Polyhedron, Semantic
from cityflow.core.points import PointCloud
from cityflow.geometry.roof_distances import roof_hits

SMALLEST_M2, LARGEST_M2 = 1.0, 15.0
"""Plan of a dormer; set by hand, as all here."""
MOST_SHARE = 0.5
"""It is so much smaller than the roof that it stands out of."""
LEAST_SLOPE = 0.27
"""What stands on a flatter roof, below 15°, is a roof of its own, a lift house or a parapet."""
RISE_M = (0.4, 3.5)
"""Height of its walls over the roof, at their highest."""
LEAST_WALLED = 0.45
"""Share of its rim that ends over the roof; a level dormer has its front and both flanks."""
OUT_M, APART_M = 0.05, 0.5
"""The roof is looked for so far beyond its rim, at places so far apart."""
NEAR_M, LEAST_POINTS = 0.2, 15
"""Points so near to its roof show it, and how many there have to be."""
IN_PLAN_M = 0.1
"""Walls within so much of its plan are its own; others go on, and are left out."""

Edge = tuple[int, int]


def find_dormers(solid: Polyhedron, roofs: PointCloud) -> tuple[Installation, ...]:
    """Those that enough points show, in the order of the solid's faces: their roofs and walls, which are the solid's.

    Parameters
    ----------
    roofs : roof points of the unit, world frame
    """
    left = {edge: k for k, f in enumerate(solid.faces) for ring in f.rings for edge in _edges(ring)}
    found = []
    for group in _groups(solid, left):
        plan = shapely.union_all([_plan(solid, solid.faces[k]) for k in group])
        rim = [e for k in group for e in _edges(solid.faces[k].rings[0]) if left.get(e[::-1], -1) not in group]
        if _stands_out(solid, plan, rim, group):
            faces = [*(solid.faces[k] for k in group), *_walls(solid, left, plan, rim)]
            points = _points_on(solid, group, plan, roofs.xyz)
            if points >= LEAST_POINTS:
                found.append(Installation("dormer", _of_faces(solid, faces), points))
    return tuple(found)


def _groups(solid: Polyhedron, left: dict[Edge, int]) -> list[frozenset[int]]:
    """Small roof faces, those with a common edge together."""
    small = [k for k, f in enumerate(solid.faces) if f.semantic is Semantic.ROOF and len(f.rings) == 1 and _plan(solid, f).area <= LARGEST_M2]  # fmt: skip
    if not small:
        return []
    row = {k: n for n, k in enumerate(small)}
    pairs = [
        (row[k], row[left[e[::-1]]]) for k in small for e in _edges(solid.faces[k].rings[0]) if left.get(e[::-1]) in row
    ]
    pairs_at = np.array(pairs, np.int64).reshape(-1, 2).T
    label = connected_components(coo_array((np.ones(len(pairs)), pairs_at), shape=(len(small),) * 2), directed=False)[1]
    return [
        frozenset(k for k, of in zip(small, label, strict=True) if of == n)
        for n in range(int(label.max(initial=-1)) + 1)
    ]


def _stands_out(solid: Polyhedron, plan: shapely.Geometry, rim: Sequence[Edge], group: frozenset[int]) -> bool:
    """Whether most of its rim ends over one larger sloped roof of the unit."""
    if not isinstance(plan, Polygon) or not SMALLEST_M2 <= plan.area <= LARGEST_M2:
        return False
    total = walled = 0.0
    faces, rises = set[int](), [0.0]
    for u, v in rim:
        a, b = solid.vertices[u], solid.vertices[v]
        length = float(np.hypot(*(b - a)[:2]))
        total += length
        count = max(1, int(length / APART_M))
        at = a + ((np.arange(count) + 0.5) / count)[:, None] * (b - a)
        at[:, :2] += OUT_M * np.array([(b - a)[1], (a - b)[0]]) / max(length, 1e-9)
        face, above = roof_hits(solid, at)
        over = (face >= 0) & (above > OUT_M) & ~np.isin(face, list(group))
        walled += length * float(over.mean())
        faces |= set(face[over].tolist())
        rises += above[over].tolist()
    if len(faces) != 1 or walled < LEAST_WALLED * total or not RISE_M[0] <= max(rises) <= RISE_M[1]:
        return False
    (main,) = faces
    ring = solid.ring(solid.faces[main].rings[0])
    slope = np.linalg.lstsq(np.column_stack([ring[:, :2] - ring[0, :2], np.ones(len(ring))]), ring[:, 2] - ring[0, 2], rcond=None)[0]  # fmt: skip
    return bool(np.hypot(*slope[:2]) >= LEAST_SLOPE and plan.area <= MOST_SHARE * _plan(solid, solid.faces[main]).area)


def _walls(solid: Polyhedron, left: dict[Edge, int], plan: shapely.Geometry, rim: Sequence[Edge]) -> Iterator[Face]:
    """Walls under its rim that are of it alone, each once."""
    near = shapely.buffer(plan, IN_PLAN_M)
    for k in dict.fromkeys(left[e[::-1]] for e in rim if e[::-1] in left):
        face = solid.faces[k]
        if face.semantic is Semantic.WALL and near.covers(shapely.multipoints(solid.ring(face.rings[0])[:, :2])):
            yield face


def _points_on(solid: Polyhedron, group: frozenset[int], plan: shapely.Geometry, xyz: FloatArray) -> int:
    near = xyz[shapely.contains_xy(plan, xyz[:, 0], xyz[:, 1])]
    face, above = roof_hits(solid, near)
    return int(np.count_nonzero(np.isin(face, list(group)) & (np.abs(above) <= NEAR_M)))


def _of_faces(solid: Polyhedron, faces: Sequence[Face]) -> Polyhedron:
    used = sorted({v for f in faces for ring in f.rings for v in ring})
    number = {v: k for k, v in enumerate(used)}
    return Polyhedron(
        solid.vertices[used],
        tuple(Face(tuple(tuple(number[v] for v in ring) for ring in f.rings), f.semantic) for f in faces),
    )


def _plan(solid: Polyhedron, face: Face) -> Polygon:
    return Polygon(solid.ring(face.rings[0])[:, :2], [solid.ring(r)[:, :2] for r in face.rings[1:]])


def _edges(ring: Sequence[int]) -> list[Edge]:
    return list(zip(ring, (*ring[1:], ring[0]), strict=True))
