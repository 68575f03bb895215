"""What is fixed to a building in CityGML 2.0: outer building installations at LoD3, with thematic surfaces."""

from __future__ import annotations

from collections.abc import Iterator

from cityflow.core.building import Building, Installation
from cityflow.io.attributes import ncname
from cityflow.io.city_models.citygml_elements import generic_xml, members_xml, polygon_xml, positions
from cityflow.io.city_models.roof_plane_attributes import counted_points

FUNCTIONS = "https://www.sig3d.org/codelists/citygml/2.0/building/2.0/BuildingInstallation_function.xml"
CODES = {"balcony": "1000"}
"""Codes of that list; it has none for dormers."""


def installations_xml(building: Building) -> Iterator[str]:
    """An element each; the geometry refers to the polygons of the surfaces that follow it."""
    for number, one in enumerate(building.installations):
        name = f"{ncname('i', building.id)}-{number}"
        links = "".join(f'<gml:surfaceMember xlink:href="#{name}-{k}"/>' for k in range(len(one.surfaces.faces)))
        yield (
            f'<bldg:outerBuildingInstallation><bldg:BuildingInstallation gml:id="{name}">\n'
            f"{generic_xml({'points': one.points})}{_function(one.kind)}\n"
            f"<bldg:lod3Geometry><gml:MultiSurface>{links}</gml:MultiSurface></bldg:lod3Geometry>\n"
            f"{''.join(_surfaces(one, name))}</bldg:BuildingInstallation></bldg:outerBuildingInstallation>\n"
        )


def _function(kind: str) -> str:
    if kind not in CODES:
        return f"<bldg:function>{kind}</bldg:function>"
    return f'<bldg:function codeSpace="{FUNCTIONS}">{CODES[kind]}</bldg:function>'


def _surfaces(one: Installation, name: str) -> Iterator[str]:
    for number, face in enumerate(one.surfaces.faces):
        kind = f"bldg:{face.semantic.value}"
        polygon = polygon_xml(f"{name}-{number}", [positions(one.surfaces.ring(ring)) for ring in face.rings])
        yield (
            f'<bldg:boundedBy><{kind} gml:id="{name}-s{number}">\n{generic_xml(counted_points(face.points))}'
            f"<bldg:lod3MultiSurface><gml:MultiSurface>{members_xml([polygon])}"
            f"</gml:MultiSurface></bldg:lod3MultiSurface></{kind}></bldg:boundedBy>\n"
        )
