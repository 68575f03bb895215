"""Polygons as flat arrays of vertices, and back, for vectorised cleaning and noding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import VERTEX_DECIMALS


def on_lattice(xy: FloatArray) -> FloatArray:
    """Coordinates as multiples of 0.1 mm (world metres), without negative zeros."""
    return np.round(xy, VERTEX_DECIMALS) + 0.0


@dataclass(frozen=True, slots=True)
class Rings:
    """All rings of many polygons.

    Attributes
    ----------
    xy : (N, 2) float64, world metres; the vertices without each ring's repeated last one
    ring : (N,) ring of each vertex, ascending
    owner : (R,) polygon of each ring, ascending; a polygon's first ring is its exterior
    polygons : number of polygons
    """

    xy: FloatArray
    ring: IntArray
    owner: IntArray
    polygons: int

    @classmethod
    def of(cls, polygons: Sequence[Polygon]) -> Rings:
        rings, owner = shapely.get_rings(np.asarray(polygons, dtype=object), return_index=True)
        xy, ring = shapely.get_coordinates(rings, return_index=True)
        last = np.append(ring[1:] != ring[:-1], True) if len(ring) else np.empty(0, bool)
        return cls(xy[~last], ring[~last].astype(np.int64), owner.astype(np.int64), len(polygons))

    @property
    def vertex_owner(self) -> IntArray:
        """(N,) polygon of each vertex."""
        return self.owner[self.ring]

    def following(self) -> IntArray:
        """(N,) index of the next vertex in the same ring."""
        return _neighbour_in_ring(self.ring, 1)

    def preceding(self) -> IntArray:
        """(N,) index of the previous vertex in the same ring."""
        return _neighbour_in_ring(self.ring, -1)

    def moved(self, xy: FloatArray) -> Rings:
        """The same rings with other coordinates; a vertex equal to the one before it is dropped."""
        return Rings(xy, self.ring, self.owner, self.polygons).without_repeats()

    def kept(self, keep: BoolArray) -> Rings:
        """The rings without some vertices; a ring may be left with too few to be one."""
        return Rings(self.xy[keep], self.ring[keep], self.owner, self.polygons)

    def without_repeats(self) -> Rings:
        if not len(self.xy):
            return self
        repeated = (self.xy == self.xy[self.preceding()]).all(axis=1)
        return self.kept(~repeated) if repeated.any() else self

    def with_inserted(self, after: IntArray, xy: FloatArray) -> Rings:
        """The rings with vertex `xy[k]` behind vertex `after[k]`; several behind the same one in the order given."""
        order = np.argsort(after, kind="stable")
        position = after[order] + 1
        return Rings(
            np.insert(self.xy, position, xy[order], axis=0),
            np.insert(self.ring, position, self.ring[after[order]]),
            self.owner,
            self.polygons,
        ).without_repeats()

    def to_polygons(self) -> list[Polygon | None]:
        """Polygons again, exterior counter-clockwise; None where the exterior has fewer than three vertices.

        Holes with fewer than three vertices are left out.
        """
        counts = np.bincount(self.ring, minlength=len(self.owner))
        whole = counts >= 3
        exterior = np.append(True, self.owner[1:] != self.owner[:-1]) if len(self.owner) else np.empty(0, bool)
        usable = whole[self.ring]
        renumbered = np.cumsum(whole) - 1
        linear = shapely.linearrings(self.xy[usable], indices=renumbered[self.ring[usable]])
        result = np.full(self.polygons, None, dtype=object)
        shells, holes = linear[exterior[whole]], linear[~exterior[whole]]
        shell_owner, hole_owner = self.owner[whole & exterior], self.owner[whole & ~exterior]
        result[shell_owner] = shapely.polygons(shells)
        for polygon in np.unique(hole_owner):
            if result[polygon] is not None:
                result[polygon] = shapely.polygons(result[polygon].exterior, holes[hole_owner == polygon])
        present = np.array([p is not None for p in result], bool)
        result[present] = shapely.orient_polygons(result[present], exterior_cw=False)
        return list(result)


def _neighbour_in_ring(ring: IntArray, step: int) -> IntArray:
    n = len(ring)
    if not n:
        return np.empty(0, np.int64)
    first = np.searchsorted(ring, ring, side="left")
    size = np.searchsorted(ring, ring, side="right") - first
    return np.asarray(first + (np.arange(n) - first + step) % size, np.int64)
