"""Party walls of neighbouring units: cut in both, so that the common part is the same face in each.

Outlines are noded, so that a common edge has the same two plan vertices in both units, bit for bit, and every wall
stands on one outline edge. The common part of an edge follows from the two walls on it and from the heights that meet
at its ends, so both units find it, vertex by vertex, in no order: a unit depends on itself and on the units that touch
it, as they were.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cityflow.core.building import Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_areas
from cityflow.geometry.validity import is_valid
from cityflow.reconstruction.party.wall_mesh import WallMesh, WallPart, coordinate_rings
from cityflow.reconstruction.party.wall_overlaps import SharedWall, share_wall
from cityflow.reconstruction.party.wall_profiles import Plan, Point, profile_of
from cityflow.reconstruction.solids.tied_heights import settled

PlanEdge = tuple[Plan, Plan]


@dataclass(frozen=True, slots=True)
class WallAreas:
    """Areas (m²) of the walls of a unit: those to the open, and those shared with neighbours."""

    outer: float
    shared: float


@dataclass(frozen=True, slots=True)
class WallBase:
    """A wall that stands on the floor: number of its face, and its ring, the ends of the base first."""

    face: int
    ring: list[Point]


@dataclass(frozen=True, slots=True)
class Corner:
    """What becomes of the heights over a plan vertex, and the heights afterwards, rising."""

    settlement: dict[float, float]
    upright: tuple[float, ...]


def cut_party_walls(polyhedra: Mapping[str, Polyhedron]) -> dict[str, Polyhedron]:
    """All units with their party walls cut and marked; those without neighbours as they are.

    A wall whose cut would spoil its solid is marked whole instead, in that solid only; `differing_walls` tells where.
    """
    bases = {unit: wall_bases(solid) for unit, solid in sorted(polyhedra.items())}
    beside = _units_beside(bases)
    corners = _corners(bases, beside, polyhedra)
    parts: dict[str, list[WallPart]] = {unit: [] for unit in polyhedra}
    for (start, end), pair in sorted(beside.items()):
        for unit, part in _parts(start, end, pair, bases, corners):
            parts[unit].append(part)
    return {unit: cut_unit(solid, parts[unit], corners) for unit, solid in polyhedra.items()}


def differing_walls(cut: Mapping[str, Polyhedron]) -> list[tuple[str, str]]:
    """Pairs of units, after `cut_party_walls`, whose faces towards each other have not the same vertices."""
    faces: dict[tuple[str, str], set[frozenset[Point]]] = {}
    for unit, solid in cut.items():
        for face, rings in zip(solid.faces, coordinate_rings(solid), strict=True):
            if face.neighbour in cut and face.neighbour is not None:
                faces.setdefault((unit, face.neighbour), set()).add(frozenset(rings[0]))
    return sorted({(min(a, b), max(a, b)) for a, b in faces if faces[a, b] != faces.get((b, a))})


def wall_areas(solid: Polyhedron) -> WallAreas:
    """Areas of the walls of a unit after `cut_party_walls`."""
    areas = face_areas(solid)
    walls = [(area, f.neighbour) for area, f in zip(areas, solid.faces, strict=True) if f.semantic is Semantic.WALL]
    outer = sum(area for area, neighbour in walls if neighbour is None)
    return WallAreas(float(outer), float(sum(area for area, _ in walls) - outer))


def wall_bases(solid: Polyhedron) -> dict[PlanEdge, WallBase]:
    """Walls that stand on the floor, by the plan edge of their base as the ring runs."""
    floor = float(solid.vertices[:, 2].min())
    bases: dict[PlanEdge, WallBase] = {}
    for number, (face, rings) in enumerate(zip(solid.faces, coordinate_rings(solid), strict=True)):
        if face.semantic is not Semantic.WALL or len(rings) > 1:
            continue
        ring = rings[0]
        on_floor = [k for k, p in enumerate(ring) if p[2] == floor == ring[(k + 1) % len(ring)][2]]
        if len(on_floor) == 1:
            ring = ring[on_floor[0] :] + ring[: on_floor[0]]
            bases[ring[0][:2], ring[1][:2]] = WallBase(number, ring)
    return bases


def cut_unit(solid: Polyhedron, parts: Sequence[WallPart], corners: Mapping[Plan, Corner]) -> Polyhedron:
    """A unit with the given walls cut; a wall whose cut would spoil the solid is marked whole instead."""
    if not parts:
        return solid
    everything = _cut(solid, parts, [], corners)
    if is_valid(everything):
        return everything
    good: list[WallPart] = []
    spoiling: list[WallPart] = []
    for part in parts:
        (good if is_valid(_cut(solid, [*good, part], [], corners)) else spoiling).append(part)
    return _cut(solid, good, spoiling, corners)


def _cut(
    solid: Polyhedron, parts: Sequence[WallPart], whole: Sequence[WallPart], corners: Mapping[Plan, Corner]
) -> Polyhedron:
    mesh = WallMesh(solid)
    for plan in sorted({plan for part in parts for plan in part.ends}):
        mesh.settle(plan, corners[plan].settlement, corners[plan].upright)
    for part in parts:
        mesh.cut(part)
    for part in whole:
        mesh.mark(part)
    return mesh.polyhedron()


def _units_beside(bases: Mapping[str, Mapping[PlanEdge, WallBase]]) -> dict[PlanEdge, tuple[str, str]]:
    """Common edges from the smaller to the greater end: the unit whose base runs so, and the one beside it."""
    first: dict[PlanEdge, str] = {}
    for unit in sorted(bases):
        for edge in bases[unit]:
            first.setdefault(edge, unit)
    pairs = {}
    for (start, end), unit in first.items():
        other = first.get((end, start), unit)
        if start < end and other != unit:
            pairs[start, end] = (unit, other)
    return pairs


def _corners(
    bases: Mapping[str, Mapping[PlanEdge, WallBase]],
    beside: Mapping[PlanEdge, tuple[str, str]],
    polyhedra: Mapping[str, Polyhedron],
) -> dict[Plan, Corner]:
    """The ends of all common edges, settled between all units that meet there."""
    heights: dict[Plan, set[float]] = {plan: set() for edge in beside for plan in edge}
    floors: dict[Plan, set[float]] = {plan: set() for plan in heights}
    for unit in bases:
        for x, y, z in polyhedra[unit].vertices.tolist():
            if (x, y) in heights:
                heights[x, y].add(z)
        for edge, base in bases[unit].items():
            for plan in edge:
                if plan in floors:
                    floors[plan].add(base.ring[0][2])
    settlements = {plan: settled(heights[plan], floors[plan]) for plan in heights}
    return {plan: Corner(s, tuple(sorted(set(s.values())))) for plan, s in settlements.items()}


def _parts(
    start: Plan,
    end: Plan,
    pair: tuple[str, str],
    bases: Mapping[str, Mapping[PlanEdge, WallBase]],
    corners: Mapping[Plan, Corner],
) -> list[tuple[str, WallPart]]:
    """What the wall on an edge becomes in both units; nothing where they do not touch."""
    walls = (bases[pair[0]][start, end], bases[pair[1]][end, start])
    first, second = (profile_of(base.ring, start) for base in walls)
    if first is None or second is None:
        return []
    shared: SharedWall | None = share_wall(first, second, {p: corners[p].settlement for p in (start, end)})
    if shared is None:
        return []
    return [(pair[k], WallPart(walls[k].face, pair[1 - k], (start, end), shared, k)) for k in (0, 1)]
