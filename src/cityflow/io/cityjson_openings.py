"""Windows and doors in CityJSON 2.0: the surfaces of a building once more at LoD 3, walls with holes and what fills them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron
from cityflow.core.openings import Opening, UnitOpenings
from cityflow.core.texture import Shell
from cityflow.io.openings import SEMANTICS, SaidOfFaces, holes, openings_of, said_of_opening, said_of_walls

LOD = "3"
Add = Callable[[FloatArray], list[int]]
"""Puts (N, 3) points among the vertices of a feature and says where they are."""


def geometry_with_openings(building: Building, found: UnitOpenings | None, add: Add) -> dict[str, Any] | None:
    """A MultiSurface with all faces of LoD2.2 and of what stands out beyond it; None where no wall has an opening."""
    shells: dict[Shell, Polyhedron | None] = {"solid": building.solids.get(Lod.LOD22), "beyond": building.beyond}
    opened = {name: openings_of(found, name, shell) for name, shell in shells.items()}
    if not any(opened.values()):
        return None
    made = _Surfaces(add)
    for name, shell in shells.items():
        if shell is not None:
            made.shell(shell, opened[name], said_of_walls(found, name, shell))
    return {
        "type": "MultiSurface", "lod": LOD, "boundaries": made.boundaries,
        "semantics": {"surfaces": made.surfaces, "values": list(range(len(made.surfaces)))},
    }  # fmt: skip


class _Surfaces:
    """Boundaries with a semantic surface each; openings are children of their walls."""

    def __init__(self, add: Add) -> None:
        self._add = add
        self.boundaries: list[list[list[int]]] = []
        self.surfaces: list[dict[str, Any]] = []

    def shell(self, shell: Polyhedron, opened: Mapping[int, tuple[Opening, ...]], said: SaidOfFaces) -> None:
        used = sorted({i for face in shell.faces for ring in face.rings for i in ring})
        index = dict(zip(used, self._add(shell.vertices[used]), strict=True))
        for number, face in enumerate(shell.faces):
            openings = opened.get(number, ())
            rings = [[index[i] for i in ring] for ring in face.rings]
            self.boundaries.append([*rings, *(self._add(ring) for ring in holes(openings))])
            party = {"is_party_wall": True} if face.neighbour is not None else {}
            self.surfaces.append({"type": face.semantic.value, **party, **said.get(number, {})})
            self._fill(openings)

    def _fill(self, openings: tuple[Opening, ...]) -> None:
        wall = len(self.surfaces) - 1
        for opening in openings:
            self.surfaces[wall].setdefault("children", []).append(len(self.surfaces))
            self.surfaces.append({"type": SEMANTICS[opening.kind], "parent": wall, **said_of_opening(opening)})
            self.boundaries.append([self._add(opening.ring)])
