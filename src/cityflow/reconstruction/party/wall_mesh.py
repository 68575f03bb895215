"""A solid whose walls are being cut: its faces as rings of points, until it is a polyhedron again.

A point is its coordinates, so that a vertex given to two faces is one vertex, and a vertex put on an edge is put into
every face beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.building import Face, Polyhedron
from cityflow.reconstruction.party.wall_overlaps import Edge, Ring, SharedWall
from cityflow.reconstruction.party.wall_profiles import Plan, Point


@dataclass(frozen=True, slots=True)
class WallPart:
    """One unit's part in a wall that it shares.

    Attributes
    ----------
    face : number of the wall's face in the unit's solid
    neighbour : id of the other unit
    ends : plan vertices of the edge, the smaller first
    shared : what becomes of both walls
    side : 0 for the unit whose base runs from the smaller end to the greater, 1 for the other
    """

    face: int
    neighbour: str
    ends: tuple[Plan, Plan]
    shared: SharedWall
    side: int


def coordinate_rings(solid: Polyhedron) -> list[list[Ring]]:
    """The rings of every face as points."""
    points: list[Point] = [(x, y, z) for x, y, z in solid.vertices.tolist()]
    return [[[points[v] for v in ring] for ring in face.rings] for face in solid.faces]


class WallMesh:
    """The faces of a solid, and what is to be done to them."""

    def __init__(self, solid: Polyhedron) -> None:
        self.faces = solid.faces
        self.rings = coordinate_rings(solid)
        self._pieces: dict[int, list[tuple[Ring, str | None]]] = {}
        self._marks: dict[int, str] = {}
        self._moved: dict[Point, Point] = {}
        self._inserted: dict[Edge, list[Point]] = {}
        self._upright: dict[Plan, tuple[float, ...]] = {}

    def settle(self, plan: Plan, settlement: Mapping[float, float], upright: tuple[float, ...]) -> None:
        """Move the heights over a plan vertex, and split vertical edges there at the given heights."""
        self._moved |= {(*plan, old): (*plan, new) for old, new in settlement.items() if old != new}
        self._upright[plan] = upright

    def cut(self, part: WallPart) -> None:
        """Put the pieces of a wall in its place."""
        shared, side = part.shared, part.shared.sides[part.side]
        turn = -1 if part.side else 1
        pieces: list[tuple[Ring, str | None]] = [(shared.common[::turn], part.neighbour)]
        self._pieces[part.face] = pieces + [(ring[::turn], None) for ring in side.free]
        self._moved |= side.moved
        self._upright |= shared.upright
        self._inserted |= side.inserted
        self._inserted |= {(b, a): between[::-1] for (a, b), between in side.inserted.items()}

    def mark(self, part: WallPart) -> None:
        """Leave a wall in one piece, but tell who is beside it."""
        self._marks[part.face] = part.neighbour

    def polyhedron(self) -> Polyhedron:
        """The solid with all of it done; faces that have shrunk to nothing are gone."""
        index: dict[Point, int] = {}
        faces = []
        for number, face in enumerate(self.faces):
            for rings, changed in self._pieces_of(number, face):
                done = [ring for ring in map(self._refined, rings) if len(ring) > 2]
                if done:
                    numbered = tuple(tuple(index.setdefault(p, len(index)) for p in ring) for ring in done)
                    faces.append(replace(changed, rings=numbered))
        return Polyhedron(np.array(list(index)), tuple(faces))

    def _pieces_of(self, number: int, face: Face) -> list[tuple[list[Ring], Face]]:
        if number in self._pieces:
            return [([ring], replace(face, neighbour=other)) for ring, other in self._pieces[number]]
        rings = [[self._moved.get(p, p) for p in ring] for ring in self.rings[number]]
        return [(rings, replace(face, neighbour=self._marks.get(number, face.neighbour)))]

    def _refined(self, ring: Ring) -> Ring:
        """A ring with all vertices that lie on its edges."""
        refined: Ring = []
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            refined.append(a)
            if a[:2] == b[:2]:
                low, high = sorted((a[2], b[2]))
                between = [(*a[:2], z) for z in self._upright.get(a[:2], ()) if low < z < high]
                refined.extend(between if a[2] < b[2] else between[::-1])
            else:
                refined.extend(self._inserted.get((a, b), ()))
        return without_spikes(refined)


def without_spikes(ring: Ring) -> Ring:
    """A ring without points that follow themselves, and without ways there and back again."""
    kept: Ring = []
    for point in ring:
        if kept and kept[-1] == point:
            continue
        if len(kept) > 1 and kept[-2] == point:
            kept.pop()
            continue
        kept.append(point)
    while len(kept) > 1 and kept[0] == kept[-1]:
        kept.pop()
    while len(kept) > 2 and kept[1] == kept[-1]:
        kept = kept[2:]
    return kept
