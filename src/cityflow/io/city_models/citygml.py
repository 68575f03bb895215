"""CityGML 2.0, LoD2 (with LoD0 footprints and LoD1 blocks, and LoD3 walls where windows are known): buildings with semantic surfaces, and the terrain as a TIN.

Written piece by piece, so that a tile of any size needs the memory of one building. What the standard has no element
for becomes a generic attribute.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import BinaryIO

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, Face, Lod, Polyhedron, Scalar, Semantic
from cityflow.core.openings import UnitOpenings
from cityflow.core.reference import Reference
from cityflow.core.texture import FaceTexture
from cityflow.io.attributes import described, ncname, scalars
from cityflow.io.city_models.appearance import BARE, Appearance, Looks
from cityflow.io.city_models.citygml_appearance import (
    BEYOND_MARK,
    NAMESPACE,
    SOLID_MARK,
    BuildingAppearance,
    draped,
    polygon_stem,
    triangle_ring,
)  # fmt: skip
from cityflow.io.city_models.citygml_elements import generic_xml, members_xml, polygon_xml, positions, text_xml
from cityflow.io.city_models.citygml_installations import installations_xml
from cityflow.io.city_models.citygml_openings import WallsWithOpenings
from cityflow.io.city_models.cityjson_sequence import Bounds3, extent_of
from cityflow.io.city_models.exported_openings import NO_OPENINGS, Openings, attributes_of_faces
from cityflow.io.city_models.roof_plane_attributes import counted_points, plane_attributes
from cityflow.io.city_models.roof_type_codes import ROOF_TYPE_CODES, roof_type_code

Tin = tuple[str, FloatArray, IntArray]
"""Name, (V, 3) world vertices, (T, 3) triangles counter-clockwise from above."""

_NAMESPACES = {
    "": "http://www.opengis.net/citygml/2.0",
    "bldg": "http://www.opengis.net/citygml/building/2.0",
    "dem": "http://www.opengis.net/citygml/relief/2.0",
    "gen": "http://www.opengis.net/citygml/generics/2.0",
    "gml": "http://www.opengis.net/gml",
    "xlink": "http://www.w3.org/1999/xlink",
    "xsi": "http://www.w3.org/2001/XMLSchema-instance",
}
_SCHEMAS = {"app": "appearance", "bldg": "building", "dem": "relief", "gen": "generics"}


def write_citygml(
    target: BinaryIO,
    buildings: Iterable[Building],
    reference: Reference,
    bounds: Bounds3 | None = None,
    terrain: Iterable[Tin] = (),
    title: str = "",
    appearance: Appearance = BARE,
    openings: Openings = NO_OPENINGS,
) -> None:
    """Write a city model; `bounds` (if known) become its envelope, `openings` its walls at LoD3, rectified textures the look of both."""
    appearance.require_rectified("CityGML")
    pieces = chain(
        _head(reference, bounds, title, with_looks=appearance.textures is not None or appearance.drape is not None),
        (f"<cityObjectMember>\n{_building(b, appearance, openings.get(b.id))}</cityObjectMember>\n" for b in buildings),
        chain.from_iterable(_relief(tin, appearance) for tin in terrain),
        ["</CityModel>\n"],
    )
    for piece in pieces:
        target.write(piece.encode())


def srs_name(reference: Reference) -> str:
    """The CRS as a URN, its parts by their own codes where the vertical one is known; empty for a local frame."""
    if reference.is_local:
        return ""
    if reference.vertical_epsg is None:
        return f"urn:ogc:def:crs:EPSG::{reference.horizontal_epsg}"
    return f"urn:ogc:def:crs,crs:EPSG::{reference.horizontal_epsg},crs:EPSG::{reference.vertical_epsg}"


def _head(reference: Reference, bounds: Bounds3 | None, title: str, with_looks: bool) -> Iterator[str]:
    namespaces = ({"app": NAMESPACE} if with_looks else {}) | _NAMESPACES
    yield '<?xml version="1.0" encoding="UTF-8"?>\n<CityModel'
    yield "".join(f'\n  xmlns{":" if p else ""}{p}="{uri}"' for p, uri in namespaces.items())
    yield f'\n  xsi:schemaLocation="{_schema_locations(namespaces)}">\n'
    if title:
        yield f"<gml:name>{text_xml(title)}</gml:name>\n"
    if bounds is not None:
        yield _envelope(bounds, srs_name(reference))


def _schema_locations(namespaces: Mapping[str, str]) -> str:
    base = "http://schemas.opengis.net/citygml"
    return " ".join(f"{namespaces[p]} {base}/{name}/2.0/{name}.xsd" for p, name in _SCHEMAS.items() if p in namespaces)


def _building(building: Building, appearance: Appearance, openings: UnitOpenings | None) -> str:
    name = ncname("b", building.id)
    bounds = extent_of([building])
    look = BuildingAppearance(appearance, building)
    walls = WallsWithOpenings(building, openings, look)
    parts = [f'<bldg:Building gml:id="{name}">\n<gml:name>{text_xml(building.id)}</gml:name>\n']
    if bounds is not None:
        parts.append(_envelope(bounds))
    parts += [generic_xml(described(building)), look.xml(walls.looks)]
    parts += [*_standard(building), walls.storeys_xml()]
    if not building.footprint.is_empty:
        parts.append(_footprint(building))
    if Lod.LOD12 in building.solids:
        members = _polygons(building.id, "1", building.solids[Lod.LOD12])
        parts.append(_solid("bldg:lod1Solid", ncname("solid1", building.id), members))
    if Lod.LOD22 in building.solids:
        parts += _lod2(building, building.solids[Lod.LOD22], look.of(SOLID_MARK), walls)
    if building.beyond is not None:
        parts += _boundary_surfaces(building, building.beyond, BEYOND_MARK, look.of(BEYOND_MARK), walls)
    parts.append("</bldg:Building>\n")
    return "".join(parts)


def _standard(building: Building) -> Iterator[str]:
    """Roof type by the SIG 3D code list, and the height of the highest vertex above the floor."""
    code = roof_type_code(building)
    if code is not None:
        yield f'<bldg:roofType codeSpace="{ROOF_TYPE_CODES}">{code}</bldg:roofType>\n'
    solid = building.solids.get(Lod.LOD22) or building.solids.get(Lod.LOD12)
    if solid is not None:
        height = float(solid.vertices[:, 2].max()) - building.ground_height
        yield f'<bldg:measuredHeight uom="m">{height:.4f}</bldg:measuredHeight>\n'


def _footprint(building: Building) -> str:
    rings = [building.footprint.exterior, *building.footprint.interiors]
    points = [np.asarray(ring.coords)[:-1, :2] for ring in rings]
    texts = [positions(np.column_stack([xy, np.full(len(xy), building.ground_height)])) for xy in points]
    polygon = polygon_xml(ncname("p", building.id) + "-0-0", texts)
    return f"<bldg:lod0FootPrint><gml:MultiSurface>{members_xml([polygon])}</gml:MultiSurface></bldg:lod0FootPrint>\n"


def _lod2(building: Building, solid: Polyhedron, looks: Looks, walls: WallsWithOpenings) -> Iterator[str]:
    """The solid, by reference to the polygons of the boundary surfaces that follow it."""
    stem = polygon_stem(building.id, SOLID_MARK)
    links = "".join(f'<gml:surfaceMember xlink:href="#{stem}{i}"/>' for i in range(len(solid.faces)))
    yield _solid_of("bldg:lod2Solid", ncname("solid2", building.id), links)
    yield from installations_xml(building)
    yield from _boundary_surfaces(building, solid, SOLID_MARK, looks, walls)


def _boundary_surfaces(
    building: Building, shell: Polyhedron, mark: str, looks: Looks, walls: WallsWithOpenings
) -> Iterator[str]:
    """Thematic surfaces with the polygons of a shell; `mark` tells their ids from those of the other one."""
    polygons = list(_polygons(building.id, mark, shell, looks))
    of_faces = attributes_of_faces(looks, walls.attributes_of(mark))
    stem = f"{ncname('s', building.id)}-{'' if mark == SOLID_MARK else mark}"
    for number, faces in enumerate(_surfaces(shell.faces, of_faces)):
        first = shell.faces[faces[0]]
        kind = f"bldg:{first.semantic.value}"
        members = members_xml([polygons[i] for i in faces])
        more = walls.xml(mark, faces, shell)
        attributes = generic_xml(_attributes_of(first, building) | of_faces.get(faces[0], {}))
        yield (
            f'<bldg:boundedBy><{kind} gml:id="{stem}{number}">\n'
            f"{attributes}<bldg:lod2MultiSurface><gml:MultiSurface>{members}"
            f"</gml:MultiSurface></bldg:lod2MultiSurface>{more}</{kind}></bldg:boundedBy>\n"
        )


def _surfaces(faces: Sequence[Face], apart: Container[int]) -> list[list[int]]:
    """Faces by boundary surface: one per roof plane and per neighbour, one for each other face and each in `apart`."""
    groups: dict[tuple[Semantic, int, str | None, int], list[int]] = {}
    for i, face in enumerate(faces):
        alone = i if i in apart or (face.plane < 0 and face.neighbour is None) else -1
        groups.setdefault((face.semantic, face.plane, face.neighbour, alone), []).append(i)
    return list(groups.values())


def _attributes_of(face: Face, building: Building) -> dict[str, Scalar]:
    attributes: dict[str, Scalar] = {}
    if 0 <= face.plane < len(building.planes):
        attributes |= {"plane": face.plane} | plane_attributes(building.planes[face.plane])
    attributes |= counted_points(face.points)
    if face.neighbour is not None:
        attributes |= {"is_party_wall": True, "neighbour": face.neighbour}
    return scalars(attributes)


def _polygons(identifier: str, mark: str, solid: Polyhedron, looks: Looks | None = None) -> Iterator[str]:
    texts = [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in (solid.vertices + 0.0).tolist()]
    stem = polygon_stem(identifier, mark)
    for i, face in enumerate(solid.faces):
        textured = looks is not None and isinstance(looks.get(i), FaceTexture)
        rings = [" ".join(texts[v] for v in (*ring, ring[0])) for ring in face.rings]
        yield polygon_xml(f"{stem}{i}", rings, textured)


def _solid(element: str, name: str, polygons: Iterable[str]) -> str:
    return _solid_of(element, name, members_xml(polygons))


def _solid_of(element: str, name: str, members: str) -> str:
    return (
        f'<{element}><gml:Solid gml:id="{name}"><gml:exterior><gml:CompositeSurface>{members}'
        f"</gml:CompositeSurface></gml:exterior></gml:Solid></{element}>\n"
    )


def _relief(tin: Tin, appearance: Appearance) -> Iterator[str]:
    name, vertices, numbers = tin
    triangles = np.asarray(numbers, np.int64)
    texts = [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in (np.asarray(vertices, np.float64) + 0.0).tolist()]
    yield f'<cityObjectMember>\n<dem:ReliefFeature gml:id="{ncname("relief", name)}">\n'
    yield f"<gml:name>{text_xml(name)}</gml:name>\n"
    if appearance.drape is not None:
        yield from draped(appearance, appearance.drape, name, vertices, triangles)
    yield "<dem:lod>2</dem:lod>\n<dem:reliefComponent>"
    yield f'<dem:TINRelief gml:id="{ncname("tin", name)}">\n<dem:lod>2</dem:lod>\n'
    yield f'<dem:tin><gml:TriangulatedSurface gml:id="{ncname("triangles", name)}"><gml:trianglePatches>\n'
    for i, (a, b, c) in enumerate(triangles.tolist()):
        ring = f"{texts[a]} {texts[b]} {texts[c]} {texts[a]}"
        named = "" if appearance.drape is None else f' gml:id="{triangle_ring(name, i)}"'
        yield (
            f"<gml:Triangle><gml:exterior><gml:LinearRing{named}><gml:posList>"
            f"{ring}</gml:posList></gml:LinearRing></gml:exterior></gml:Triangle>\n"
        )
    yield "</gml:trianglePatches></gml:TriangulatedSurface></dem:tin>\n</dem:TINRelief></dem:reliefComponent>\n"
    yield "</dem:ReliefFeature>\n</cityObjectMember>\n"


def _envelope(bounds: Bounds3, srs: str = "") -> str:
    named = f' srsName="{srs}"' if srs else ""
    low, high = (" ".join(f"{v + 0.0:.4f}" for v in corner) for corner in (bounds[:3], bounds[3:]))
    return (
        f'<gml:boundedBy><gml:Envelope{named} srsDimension="3"><gml:lowerCorner>{low}</gml:lowerCorner>'
        f"<gml:upperCorner>{high}</gml:upperCorner></gml:Envelope></gml:boundedBy>\n"
    )
