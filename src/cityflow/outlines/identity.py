"""Ids for outlines without ids, from their positions, so that a rerun gives the same ids."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

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
    names = _where_one(places_of(polygons), [geometry_key(p) for p in polygons])
    return numbered_where_repeated(names)


def places_of(polygons: Sequence[Polygon]) -> list[str]:
    """Representative point of each polygon in decimetres, ``x_y``."""
    points = shapely.point_on_surface(np.asarray(polygons, dtype=object))
    decimetres = np.rint(shapely.get_coordinates(points) * 10).astype(np.int64)
    return [f"{x}_{y}" for x, y in decimetres.tolist()]


def geometry_key(polygon: Polygon) -> bytes:
    """16 bytes, the same for any start vertex and direction of the rings."""
    return hashlib.sha256(shapely.to_wkb(shapely.normalize(polygon))).digest()[:16]


def _where_one(places: Sequence[str], keys: Sequence[bytes]) -> list[str]:
    """Names by places; outlines of the same place carry six digits of their key, too."""
    shared = Counter(places)
    return [f"{p}-{k.hex()[:6]}" if shared[p] > 1 else p for p, k in zip(places, keys, strict=True)]


@dataclass(frozen=True, slots=True)
class Settled:
    """Which outlines of a whole file stay, and under which names.

    Attributes
    ----------
    first : (N,) names before any is changed: their own, or one from their geometry
    names : (N,) final names; those of repeated polygons are of no use
    twin_of : number of an outline → number of the one with the same polygon that came before
    """

    first: list[str]
    names: list[str]
    twin_of: dict[int, int]


def settled(ids: Sequence[str], places: Sequence[str], keys: Sequence[bytes]) -> Settled:
    """The same polygon twice: the first stays. The same id for two polygons: the second is renamed.

    Parameters
    ----------
    ids : in the order of the file; empty where there is none
    places, keys : see `places_of` (asked for only where there is no id) and `geometry_key`
    """
    nameless = [i for i, name in enumerate(ids) if not name]
    made = numbered_where_repeated(_where_one([places[i] for i in nameless], [keys[i] for i in nameless]))
    first = list(ids)
    for i, name in zip(nameless, made, strict=True):
        first[i] = name
    earliest: dict[bytes, int] = {}
    twin_of = {i: earliest[k] for i, k in enumerate(keys) if earliest.setdefault(k, i) != i}
    kept = [i for i in range(len(first)) if i not in twin_of]
    names = list(first)
    for i, name in zip(kept, numbered_where_repeated([first[i] for i in kept]), strict=True):
        names[i] = name
    return Settled(first, names, twin_of)


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
