"""Windows and doors in CityGML 2.0: walls with holes and openings, as LoD3 of the boundary surfaces of LoD2."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Scalar
from cityflow.core.openings import Opening, UnitOpenings
from cityflow.core.texture import FaceTexture
from cityflow.io.attributes import ncname
from cityflow.io.city_models.appearance import Look
from cityflow.io.city_models.citygml_appearance import BEYOND_MARK, SOLID_MARK, BuildingAppearance, polygon_stem
from cityflow.io.city_models.citygml_elements import generic_xml, polygon_xml, positions
from cityflow.io.city_models.exported_openings import (
    SEMANTICS,
    attributes_of_opening,
    attributes_of_walls,
    holes,
    openings_of,
    source_storeys,
)
from cityflow.io.city_models.opening_looks import opened_looks


class WallsWithOpenings:
    """The boundary of one building at LoD3: walls with openings are polygons of their own, all else refers to those of LoD2.

    A building without openings has no LoD3.
    """

    def __init__(self, building: Building, found: UnitOpenings | None, look: BuildingAppearance) -> None:
        self._id = building.id
        counted = None if found is None else found.storeys
        # what the source says of storeys stands among the generic attributes: two figures that differ would help nobody
        self._storeys = source_storeys(building) or counted
        shells = {SOLID_MARK: building.solids.get(Lod.LOD22), BEYOND_MARK: building.beyond}
        self._attributes: Mapping[str, Mapping[int, Mapping[str, Scalar]]] = {
            SOLID_MARK: attributes_of_walls(found, "solid", shells[SOLID_MARK]),
            BEYOND_MARK: attributes_of_walls(found, "beyond", shells[BEYOND_MARK]),
        }
        self._openings: Mapping[str, Mapping[int, tuple[Opening, ...]]] = {
            SOLID_MARK: openings_of(found, "solid", shells[SOLID_MARK]),
            BEYOND_MARK: openings_of(found, "beyond", shells[BEYOND_MARK]),
        }
        self._any = any(self._openings.values())
        self.looks = {k: v for mark, shell in shells.items() for k, v in self._looks(mark, shell, look)}
        """How walls with openings and what fills them look, by the gml:ids of their polygons; those that look as ever are left out."""

    def attributes_of(self, mark: str) -> Mapping[int, Mapping[str, Scalar]]:
        """Attributes of the walls of a shell, by the number of the face."""
        return self._attributes[mark]

    def storeys_xml(self) -> str:
        """Storeys as the source says them, else as far as rows of windows tell of them."""
        return "" if not self._storeys else f"<bldg:storeysAboveGround>{self._storeys}</bldg:storeysAboveGround>\n"

    def xml(self, mark: str, faces: Sequence[int], shell: Polyhedron) -> str:
        """LoD3 of the boundary surface that consists of some faces of a shell."""
        if not self._any:
            return ""
        members = "".join(self._member(mark, i, shell) for i in faces)
        lod3 = f"<bldg:lod3MultiSurface><gml:MultiSurface>{members}</gml:MultiSurface></bldg:lod3MultiSurface>"
        return lod3 + "".join(text for i in faces for text in self._fillings(mark, i))

    def _member(self, mark: str, number: int, shell: Polyhedron) -> str:
        openings = self._openings[mark].get(number)
        if openings is None:
            return f'<gml:surfaceMember xlink:href="#{polygon_stem(self._id, mark)}{number}"/>'
        rings = [*(shell.ring(ring) for ring in shell.faces[number].rings), *holes(openings)]
        return f"<gml:surfaceMember>{self._polygon(self._wall(mark, number), rings)}</gml:surfaceMember>"

    def _fillings(self, mark: str, number: int) -> Iterator[str]:
        for n, opening in enumerate(self._openings[mark].get(number, ())):
            name, kind = self._opening(mark, number, n), f"bldg:{SEMANTICS[opening.kind]}"
            polygon = self._polygon(f"{name}-p", [opening.ring])
            yield (
                f'<bldg:opening><{kind} gml:id="{name}">{generic_xml(attributes_of_opening(opening))}<bldg:lod3MultiSurface><gml:MultiSurface>'
                f"<gml:surfaceMember>{polygon}</gml:surfaceMember></gml:MultiSurface></bldg:lod3MultiSurface></{kind}></bldg:opening>"
            )

    def _looks(self, mark: str, shell: Polyhedron | None, look: BuildingAppearance) -> Iterator[tuple[str, Look]]:
        if shell is None:
            return
        for number, opened in opened_looks(look.of(mark), self._openings[mark], shell, look.pages):
            if opened.wall is not None:
                yield self._wall(mark, number), opened.wall
            yield from ((f"{self._opening(mark, number, n)}-p", part) for n, part in enumerate(opened.fillings))

    def _polygon(self, name: str, rings: Sequence[FloatArray]) -> str:
        return polygon_xml(name, [positions(ring) for ring in rings], isinstance(self.looks.get(name), FaceTexture))

    def _wall(self, mark: str, number: int) -> str:
        return f"{ncname('w', self._id)}-{mark}-{number}"

    def _opening(self, mark: str, number: int, n: int) -> str:
        return f"{ncname('o', self._id)}-{mark}-{number}-{n}"
