"""Ids for outlines without ids, from their positions, so that a rerun gives the same ids."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from cityflow.core.building import Outline


def ids_from_geometry(polygons: Sequence[Polygon]) -> list[str]:
    """One id per polygon: its representative point in decimetres, ``x_y``.

    Two outlines share a representative point only where they overlap; both then carry six hexadecimal digits of their
    geometry's hash, and, should they be the same polygon, a count. The id of an outline does not depend on the order of
    the others, nor on their number.

    >>> ids_from_geometry([shapely.box(10, 20, 14, 22)])
    ['120_210']
    """
    points = shapely.point_on_surface(np.asarray(polygons, dtype=object))
    decimetres = np.rint(shapely.get_coordinates(points) * 10).astype(np.int64)
    ids = [f"{x}_{y}" for x, y in decimetres.tolist()]
    shared = Counter(ids)
    ids = [
        f"{name}-{_geometry_hash(polygon)}" if shared[name] > 1 else name
        for name, polygon in zip(ids, polygons, strict=True)
    ]
    return numbered_where_repeated(ids)


def with_ids(outlines: Sequence[Outline]) -> list[Outline]:
    """Every outline with an id: its own, or one from its geometry.

    Geometry that has no place (empty, not finite) is named by its position: it will be refused under that name.
    """
    nameless = [i for i, outline in enumerate(outlines) if not outline.id]
    placed = [i for i in nameless if _has_place(outlines[i].polygon)]
    names = {i: f"unplaced-{i + 1}" for i in nameless}
    names |= dict(zip(placed, ids_from_geometry([outlines[i].polygon for i in placed]), strict=True))
    return [replace(outline, id=names[i]) if i in names else outline for i, outline in enumerate(outlines)]


def _has_place(geometry: BaseGeometry | None) -> bool:
    return geometry is not None and not geometry.is_empty and bool(np.isfinite(shapely.get_coordinates(geometry)).all())


def numbered_where_repeated(ids: Sequence[str]) -> list[str]:
    """The ids, later ones of the same name with the suffix ``-2``, ``-3``, …; never an id that is already there.

    >>> numbered_where_repeated(["a", "b", "a"])
    ['a', 'b', 'a-2']
    """
    taken, seen, result = set(ids), set[str](), []
    for name in ids:
        fresh, count = name, 1
        while fresh in seen or (count > 1 and fresh in taken):
            count += 1
            fresh = f"{name}-{count}"
        seen.add(fresh)
        result.append(fresh)
    return result


def _geometry_hash(polygon: Polygon) -> str:
    """Six hexadecimal digits, the same for any start vertex and direction of the rings."""
    return hashlib.sha256(shapely.to_wkb(shapely.normalize(polygon))).hexdigest()[:6]
