"""Openings as files have them: which face of which shell of a building has which."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Polyhedron, Scalar, Semantic
from cityflow.core.openings import Opening, UnitOpenings
from cityflow.core.texture import Shell

Openings = Mapping[str, UnitOpenings]
"""Building id → what its walls show."""

NO_OPENINGS: Openings = MappingProxyType({})

SEMANTICS = {"window": "Window", "door": "Door"}
"""By the names that CityGML and CityJSON share."""


def openings_of(
    found: UnitOpenings | None, shell: Shell, polyhedron: Polyhedron | None
) -> dict[int, tuple[Opening, ...]]:
    """Openings of the walls of one shell of a building, by the number of the face; walls without one are left out."""
    if found is None or polyhedron is None:
        return {}
    faces = {f.key[1]: f.openings for f in found.faces if f.key[0] == shell and f.openings}
    return {k: faces[k] for k in sorted(faces) if k < len(polyhedron.faces) and _may_have(polyhedron.faces[k])}


def _may_have(face: Face) -> bool:
    return face.semantic is Semantic.WALL and face.neighbour is None


def holes(openings: tuple[Opening, ...]) -> list[FloatArray]:
    """(4, 3) rings of holes in a wall, clockwise seen from outside."""
    return [o.ring[::-1] for o in openings]


def said_of_opening(opening: Opening) -> dict[str, Scalar]:
    """Attributes of a window or a door."""
    said: dict[str, Scalar] = {"confidence": round(float(opening.confidence), 3)}
    return said | {"completed": True} if opening.completed else said
