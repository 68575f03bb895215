"""Windows and doors in CityJSON 2.0: the surfaces of a building repeated at LoD 3, with walls with holes and openings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron
from cityflow.core.openings import Opening, UnitOpenings
from cityflow.core.texture import Shell, TexturePage
from cityflow.io.city_models.appearance import Look, Looks
from cityflow.io.city_models.cityjson_appearance import FeatureAppearance
from cityflow.io.city_models.exported_openings import (
    SEMANTICS,
    AttributesOfFaces,
    attributes_of_opening,
    attributes_of_walls,
    holes,
    openings_of,
)
from cityflow.io.city_models.opening_looks import OpenedLook, opened_looks

LOD = "3"
Add = Callable[[FloatArray], list[int]]
"""Puts (N, 3) points among the vertices of a feature and says where they are."""


def geometry_with_openings(
    building: Building, found: UnitOpenings | None, add: Add, look: FeatureAppearance
) -> dict[str, Any] | None:
    """A MultiSurface with all faces of LoD2.2 and of what stands out beyond it; None where no wall has an opening."""
    shells: dict[Shell, Polyhedron | None] = {"solid": building.solids.get(Lod.LOD22), "beyond": building.beyond}
    opened = {name: openings_of(found, name, shell) for name, shell in shells.items()}
    if not any(opened.values()):
        return None
    made = _Surfaces(add, look.pages)
    for name, shell in shells.items():
        if shell is not None:
            made.shell(shell, opened[name], attributes_of_walls(found, name, shell), look.of(name))
    return {
        "type": "MultiSurface", "lod": LOD, "boundaries": made.boundaries,
        "semantics": {"surfaces": made.surfaces, "values": list(range(len(made.surfaces)))},
        **look.members(made.boundaries, made.looks),
    }  # fmt: skip


class _Surfaces:
    """Boundaries with a semantic surface each; openings are children of their walls."""

    def __init__(self, add: Add, pages: Sequence[TexturePage]) -> None:
        self._add, self._pages = add, pages
        self.boundaries: list[list[list[int]]] = []
        self.surfaces: list[dict[str, Any]] = []
        self.looks: dict[int, Look] = {}

    def shell(
        self, shell: Polyhedron, opened: Mapping[int, tuple[Opening, ...]], attributes: AttributesOfFaces, looks: Looks
    ) -> None:
        used = sorted({i for face in shell.faces for ring in face.rings for i in ring})
        index = dict(zip(used, self._add(shell.vertices[used]), strict=True))
        walls = dict(opened_looks(looks, opened, shell, self._pages))
        for number, face in enumerate(shell.faces):
            self._paint(walls.get(number) or OpenedLook(looks.get(number)))
            openings = opened.get(number, ())
            rings = [[index[i] for i in ring] for ring in face.rings]
            self.boundaries.append([*rings, *(self._add(ring) for ring in holes(openings))])
            party = {"is_party_wall": True} if face.neighbour is not None else {}
            self.surfaces.append({"type": face.semantic.value, **party, **attributes.get(number, {})})
            self._fill(openings)

    def _paint(self, look: OpenedLook) -> None:
        """How the next boundaries look: a face, and what fills its holes."""
        first = len(self.boundaries)
        self.looks |= {first + n: part for n, part in enumerate((look.wall, *look.fillings)) if part is not None}

    def _fill(self, openings: tuple[Opening, ...]) -> None:
        wall = len(self.surfaces) - 1
        for opening in openings:
            self.surfaces[wall].setdefault("children", []).append(len(self.surfaces))
            self.surfaces.append({"type": SEMANTICS[opening.kind], "parent": wall, **attributes_of_opening(opening)})
            self.boundaries.append([self._add(opening.ring)])
