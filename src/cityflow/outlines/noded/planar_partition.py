"""A group of noded outlines as a planar partition: overlaps assigned to one, slivers between them closed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import IntArray
from cityflow.outlines.noded.rings import Rings, on_lattice

LATTICE_M = 1e-4
"""Overlays round to a tenth of a millimetre."""


def partition(polygons: Sequence[Polygon], tolerance: float) -> list[list[Polygon]]:
    """The parts of the plane that each polygon keeps; they share their vertices and do not overlap.

    Where polygons overlap the smallest keeps the common part: a small one inside a large one is the more detailed
    statement. Gaps between them narrower than `tolerance` go to the one with the longest boundary there.

    Parameters
    ----------
    polygons : in an order that does not depend on where they come from: it decides between equals
    """
    faces = _faces(polygons)
    owner = _owners(faces, polygons)
    owner = _with_slivers(faces, owner, tolerance)
    return [_joined(faces[owner == index]) for index in range(len(polygons))]


def _faces(polygons: Sequence[Polygon]) -> np.ndarray:
    """Faces of the arrangement of all boundaries, vertices on the lattice."""
    lines = shapely.union_all(shapely.boundary(np.asarray(polygons, dtype=object)), grid_size=LATTICE_M)
    faces = shapely.get_parts(shapely.polygonize([lines]))
    return np.asarray(shapely.transform(faces, on_lattice))


def _owners(faces: np.ndarray, polygons: Sequence[Polygon]) -> IntArray:
    """(faces,) the smallest polygon over each face, -1 where there is none."""
    by_area = sorted(range(len(polygons)), key=lambda i: (polygons[i].area, i))
    rank = np.empty(len(polygons), np.int64)
    rank[by_area] = np.arange(len(polygons))
    inside = shapely.point_on_surface(faces)
    face, polygon = shapely.STRtree(np.asarray(polygons, dtype=object)).query(inside, predicate="within")
    best = np.full(len(faces), len(polygons), np.int64)
    np.minimum.at(best, face, rank[polygon])
    return np.array([by_area[b] if b < len(polygons) else -1 for b in best], np.int64)


def _with_slivers(faces: np.ndarray, owner: IntArray, tolerance: float) -> IntArray:
    """Narrow faces that nobody owns, given to the neighbour with the longest common boundary."""
    rings = Rings.of(list(faces))
    narrow = (owner < 0) & shapely.is_empty(shapely.buffer(faces, -0.5 * tolerance))
    if not narrow.any():
        return owner
    ends = np.sort(_complex(rings.xy)[np.column_stack([np.arange(len(rings.xy)), rings.following()])], axis=1)
    _, edge = np.unique(ends, axis=0, return_inverse=True)
    face_of = rings.vertex_owner
    length = np.abs(ends[:, 0] - ends[:, 1])
    result = owner.copy()
    for sliver in np.flatnonzero(narrow):
        mine = edge[face_of == sliver]
        beside = np.isin(edge, mine) & (owner[face_of] >= 0)
        if beside.any():
            result[sliver] = np.argmax(np.bincount(owner[face_of[beside]], np.round(length[beside], 6)))
    return result


def _complex(xy: np.ndarray) -> np.ndarray:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _joined(faces: np.ndarray) -> list[Polygon]:
    """Faces of one owner as polygons, largest first, every vertex kept."""
    if not len(faces):
        return []
    joined: BaseGeometry = shapely.union_all(faces)
    parts = [p for p in shapely.get_parts(joined) if isinstance(p, Polygon)]
    return sorted(shapely.orient_polygons(parts, exterior_cw=False), key=lambda p: (-p.area, p.bounds))
