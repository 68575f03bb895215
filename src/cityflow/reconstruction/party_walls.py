"""Walls that neighbouring units share: cut in both, so that the common part is a face of its own in each.

Outlines are noded, so that a common edge has the same two plan vertices in both units, bit for bit, and every wall
stands on one outline edge. What a unit becomes depends on itself and its neighbours as they were, in no order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_areas
from cityflow.geometry.validity import is_valid
from cityflow.reconstruction.wall_pieces import WallPieces, cut_wall
from cityflow.reconstruction.wall_profiles import Profile, Spot, profile_of

PlanEdge = tuple[tuple[float, float], tuple[float, float]]
Coordinates = list[tuple[float, float, float]]

STRAIGHT = 3e-4
"""A new vertex this near (m) to the line between its only two neighbours is left out."""


@dataclass(frozen=True, slots=True)
class WallAreas:
    """Areas (m²) of the walls of a unit: those to the open, and those shared with neighbours."""

    outer: float
    shared: float


@dataclass(frozen=True, slots=True)
class PartyWall:
    """An edge as the foot of this unit's wall runs, and the unit beside it: id, ring of its wall there, solid."""

    edge: PlanEdge
    neighbour: str
    ring: list[int]
    solid: Polyhedron


def cut_party_walls(polyhedra: Mapping[str, Polyhedron]) -> dict[str, Polyhedron]:
    """All units with their party walls cut and marked; those without neighbours as they are."""
    feet = {unit: wall_feet(solid) for unit, solid in polyhedra.items()}
    beside: dict[PlanEdge, list[str]] = {}
    for unit in sorted(feet):
        for edge in feet[unit]:
            beside.setdefault(edge, []).append(unit)
    cut = {}
    for unit, solid in polyhedra.items():
        shared = []
        for (start, end), _ in sorted(feet[unit].items()):
            other = next((u for u in beside.get((end, start), []) if u != unit), None)
            if other is not None:
                shared.append(PartyWall((start, end), other, feet[other][end, start], polyhedra[other]))
        cut[unit] = cut_unit(solid, shared)
    return cut


def wall_areas(solid: Polyhedron) -> WallAreas:
    """Areas of the walls of a unit after `cut_party_walls`."""
    areas = face_areas(solid)
    walls = [(area, f.neighbour) for area, f in zip(areas, solid.faces, strict=True) if f.semantic is Semantic.WALL]
    outer = sum(area for area, neighbour in walls if neighbour is None)
    return WallAreas(float(outer), float(sum(area for area, _ in walls) - outer))


def wall_feet(solid: Polyhedron) -> dict[PlanEdge, list[int]]:
    """Walls that stand on the floor, by the plan edge of their foot; rings begin with the foot."""
    xyz = _coordinates(solid)
    floor = min(z for _, _, z in xyz)
    feet: dict[PlanEdge, list[int]] = {}
    for face in solid.faces:
        if face.semantic is not Semantic.WALL or len(face.rings) > 1:
            continue
        ring = list(face.rings[0])
        on_floor = [k for k, v in enumerate(ring) if xyz[v][2] == floor and xyz[ring[(k + 1) % len(ring)]][2] == floor]
        if len(on_floor) == 1:
            ring = ring[on_floor[0] :] + ring[: on_floor[0]]
            feet[xyz[ring[0]][:2], xyz[ring[1]][:2]] = ring
    return feet


def cut_unit(solid: Polyhedron, shared: Sequence[PartyWall]) -> Polyhedron:
    """A unit with the given walls cut; a wall whose cut would spoil the solid is marked whole instead."""
    everything = _cut(solid, shared)
    if everything is not None and is_valid(everything):
        return everything
    for wall in shared:
        one = _cut(solid, [wall])
        solid = one if one is not None and is_valid(one) else _marked(solid, wall)
    return solid


def _cut(solid: Polyhedron, shared: Sequence[PartyWall]) -> Polyhedron | None:
    mesh = _Mesh(solid)
    for wall in shared:
        if not mesh.cut(wall):
            return None
    return mesh.polyhedron()


def _marked(solid: Polyhedron, wall: PartyWall) -> Polyhedron:
    """The solid with the whole wall on an edge marked, where the two walls touch at all."""
    mesh = _Mesh(solid)
    found = mesh.profiles(wall)
    if found is None:
        return solid
    number, own, other = found
    if min(max(p[3] for p in own.points), max(p[3] for p in other.points)) <= max(own.floor, other.floor):
        return solid
    faces = list(solid.faces)
    faces[number] = replace(faces[number], neighbour=wall.neighbour)
    return Polyhedron(solid.vertices, tuple(faces))


def _coordinates(solid: Polyhedron) -> Coordinates:
    return [(float(x), float(y), float(z)) for x, y, z in solid.vertices]


class _Mesh:
    """A solid whose walls are being cut."""

    def __init__(self, solid: Polyhedron) -> None:
        self.xyz = _coordinates(solid)
        self.faces = list(solid.faces)

    def polyhedron(self) -> Polyhedron:
        used = sorted({v for face in self.faces for ring in face.rings for v in ring})
        index = {v: k for k, v in enumerate(used)}
        faces = (replace(f, rings=tuple(tuple(index[v] for v in ring) for ring in f.rings)) for f in self.faces)
        return Polyhedron(np.array([self.xyz[v] for v in used]), tuple(faces))

    def profiles(self, wall: PartyWall) -> tuple[int, Profile, Profile] | None:
        """Number of the face on the wall's edge, its profile, and that of the wall beside it."""
        number, ring = self._wall_on(wall.edge)
        if number < 0:
            return None
        start = min(wall.edge)
        own, other = profile_of(ring, self.xyz, start), profile_of(wall.ring, _coordinates(wall.solid), start)
        return None if own is None or other is None else (number, own, other)

    def _wall_on(self, edge: PlanEdge) -> tuple[int, list[int]]:
        floor = min(z for _, _, z in self.xyz)
        for number, face in enumerate(self.faces):
            if face.semantic is not Semantic.WALL or len(face.rings) > 1:
                continue
            ring = face.rings[0]
            for k, u in enumerate(ring):
                v = ring[(k + 1) % len(ring)]
                if self.xyz[u] == (*edge[0], floor) and self.xyz[v] == (*edge[1], floor):
                    return number, [*ring[k:], *ring[:k]]
        return -1, []

    def cut(self, wall: PartyWall) -> bool:
        """Cut one wall; False where the pieces do not make up the wall again."""
        found = self.profiles(wall)
        if found is None:
            return False
        number, own, other = found
        pieces = cut_wall(own, other)
        if pieces is None:
            return True
        reverse = min(wall.edge) != wall.edge[0]
        rings = self._rings(pieces, reverse)
        border = _border(rings)
        old = self.faces[number].rings[0]
        if border is None or not set(old) <= set(border):
            return False
        rings, border = _without_idle(rings, border, set(old), self.xyz)
        face = self.faces[number]
        new = [Face((tuple(rings[0]),), face.semantic, face.plane, wall.neighbour)]
        new += [Face((tuple(ring),), face.semantic, face.plane) for ring in rings[1:]]
        self.faces[number : number + 1] = new
        return self._refine_twins(old, border)

    def _rings(self, pieces: WallPieces, reverse: bool) -> list[list[int]]:
        """Rings of vertex numbers, the common part's first, counter-clockwise seen from outside."""
        numbers: dict[Spot, int] = {}
        rings = []
        for spots in (pieces.common, *pieces.free):
            for spot in spots:
                if spot not in numbers:
                    numbers[spot] = spot.vertex if spot.vertex >= 0 else len(self.xyz)
                    if spot.vertex < 0:
                        self.xyz.append((spot.x, spot.y, spot.z))
            ring = [numbers[spot] for spot in spots]
            rings.append(ring[::-1] if reverse else ring)
        return rings

    def _refine_twins(self, old: Sequence[int], border: list[int]) -> bool:
        """Put the new vertices on the old wall's edges into the faces beside it too."""
        place = {v: k for k, v in enumerate(border)}
        for u, v in zip(old, [*old[1:], old[0]], strict=True):
            k, between = place[u], []
            while border[(k + 1) % len(border)] != v:
                k += 1
                between.append(border[k % len(border)])
                if len(between) > len(border):
                    return False
            if between and not self._insert(v, u, between[::-1]):
                return False
        return True

    def _insert(self, u: int, v: int, between: list[int]) -> bool:
        for number, face in enumerate(self.faces):
            for r, ring in enumerate(face.rings):
                for k, vertex in enumerate(ring):
                    if vertex == u and ring[(k + 1) % len(ring)] == v:
                        longer = (*ring[: k + 1], *between, *ring[k + 1 :])
                        self.faces[number] = replace(face, rings=(*face.rings[:r], longer, *face.rings[r + 1 :]))
                        return True
        return False


def _border(rings: list[list[int]]) -> list[int] | None:
    """The ring around all pieces; None where they do not fit together."""
    edges = [edge for ring in rings for edge in zip(ring, [*ring[1:], ring[0]], strict=True)]
    once = set(edges)
    if len(once) < len(edges):
        return None
    outer = [(a, b) for a, b in edges if (b, a) not in once]
    following = dict(outer)
    if len(following) < len(outer) or not outer:
        return None
    border = [outer[0][0]]
    while (vertex := following[border[-1]]) != border[0]:
        border.append(vertex)
        if len(border) > len(outer) or vertex not in following:
            return None
    return border if len(border) == len(outer) else None


def _without_idle(
    rings: list[list[int]], border: list[int], old: set[int], xyz: Coordinates
) -> tuple[list[list[int]], list[int]]:
    """Pieces and border without the new vertices at which no cut ends or bends."""
    ends: dict[int, set[int]] = {}
    for ring in rings:
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            ends.setdefault(a, set()).add(b)
            ends.setdefault(b, set()).add(a)
    idle: set[int] = set()
    for vertex in sorted(set(ends) - old):
        if len(ends[vertex]) != 2:
            continue
        a, b = sorted(ends[vertex])
        if _is_straight(vertex, a, b, xyz):
            idle.add(vertex)
            ends[a] = (ends[a] - {vertex}) | {b}
            ends[b] = (ends[b] - {vertex}) | {a}
    return [[v for v in ring if v not in idle] for ring in rings], [v for v in border if v not in idle]


def _is_straight(vertex: int, a: int, b: int, xyz: Coordinates) -> bool:
    here, start, end = (np.array(xyz[v]) for v in (vertex, a, b))
    return bool(np.linalg.norm(np.cross(here - start, end - start)) <= STRAIGHT * np.linalg.norm(end - start))
