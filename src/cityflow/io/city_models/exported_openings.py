"""Openings in exported files: by shell and face of a building."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Face, Polyhedron, Scalar, Semantic
from cityflow.core.openings import TOO_LITTLE, FaceOpenings, Opening, UnitOpenings
from cityflow.core.texture import Shell
from cityflow.io.attributes import xml_text
from cityflow.io.city_models.appearance import Looks, attributes_of_look

Openings = Mapping[str, UnitOpenings]
"""Building id → what its walls show."""

AttributesOfFaces = Mapping[int, Mapping[str, Scalar]]
"""Attributes of the faces of a shell by their number."""

NO_OPENINGS: Openings = MappingProxyType({})

SEMANTICS = {"window": "Window", "door": "Door"}
"""By the names that CityGML and CityJSON share."""

SOURCE_STOREYS = ("storeysAboveGround", "storeys_above_ground", "storeys")
"""Names that sources have for storeys above ground."""


def openings_of(
    found: UnitOpenings | None, shell: Shell, polyhedron: Polyhedron | None
) -> dict[int, tuple[Opening, ...]]:
    """Openings of the walls of one shell of a building, by the number of the face; walls without one are left out."""
    if found is None or polyhedron is None:
        return {}
    faces = {f.key[1]: f.openings for f in found.faces if f.key[0] == shell and f.openings}
    return {k: faces[k] for k in sorted(faces) if k < len(polyhedron.faces) and _may_have(polyhedron.faces[k])}


def attributes_of_faces(looks: Looks, walls: AttributesOfFaces) -> dict[int, dict[str, Scalar]]:
    """What textures and windows say of the faces of a shell, by their numbers; faces of which nobody says anything are left out."""
    attributes = {k: {**attributes_of_look(looks[k])} if k in looks else {} for k in sorted({*looks, *walls})}
    return {k: row for k, own in attributes.items() if (row := {**own, **walls.get(k, {})})}


def attributes_of_walls(
    found: UnitOpenings | None, shell: Shell, polyhedron: Polyhedron | None
) -> dict[int, dict[str, Scalar]]:
    """Attributes of the walls of one shell that somebody has looked at, or could not look at, by the number of the face."""
    if found is None or polyhedron is None:
        return {}
    walls = {f.key[1]: f for f in found.faces if f.key[0] == shell and f.key[1] < len(polyhedron.faces)}
    return {k: _attributes_of_wall(walls[k]) for k in sorted(walls) if _may_have(polyhedron.faces[k])}


def _attributes_of_wall(wall: FaceOpenings) -> dict[str, Scalar]:
    """How many windows, their share of what is seen of the wall, their confidence; or why they are unknown."""
    sure = [float(o.confidence) for o in wall.openings if o.kind == "window"]
    attributes: dict[str, Scalar] = {}
    if sure or wall.window_to_wall is not None:
        attributes["windows"] = len(sure)
    if sure:
        attributes["windows_confidence"] = round(sum(sure) / len(sure), 3)
    if wall.window_to_wall is not None:
        attributes["window_to_wall_ratio"] = round(float(wall.window_to_wall), 4)
    else:
        attributes["window_to_wall_missing" if sure else "windows_missing"] = xml_text(wall.reason or TOO_LITTLE)
    if wall.area_m2 > 0:
        attributes["windows_seen_share"] = round(min(wall.seen_m2 / wall.area_m2, 1.0), 3)
    return attributes


def source_storeys(building: Building) -> int | None:
    """Storeys above ground that the building's source has counted; None where it says nothing of them, or no whole number."""
    for name in SOURCE_STOREYS:
        value = building.attributes.get(name)
        if isinstance(value, int | float) and not isinstance(value, bool) and value == round(value) and value > 0:
            return int(value)
    return None


def _may_have(face: Face) -> bool:
    return face.semantic is Semantic.WALL and face.neighbour is None


def holes(openings: tuple[Opening, ...]) -> list[FloatArray]:
    """(4, 3) rings of holes in a wall, clockwise seen from outside."""
    return [o.ring[::-1] for o in openings]


def attributes_of_opening(opening: Opening) -> dict[str, Scalar]:
    """Attributes of a window or a door."""
    attributes: dict[str, Scalar] = {"confidence": round(float(opening.confidence), 3)}
    return attributes | {"completed": True} if opening.completed else attributes
