"""Reads every geometry of a CityGML 2.0 file, independently of cityflow's writer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import BinaryIO
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.written_geometry import GeometryKind, WrittenGeometry

GML, XLINK = "{http://www.opengis.net/gml}", "{http://www.w3.org/1999/xlink}"
_KINDS = {
    f"{GML}Solid": GeometryKind.SOLID,
    f"{GML}MultiSurface": GeometryKind.MULTI_SURFACE,
    f"{GML}CompositeSurface": GeometryKind.COMPOSITE_SURFACE,
    f"{GML}TriangulatedSurface": GeometryKind.COMPOSITE_SURFACE,
}
Rings = tuple[FloatArray, ...]


def written_in_citygml(source: BinaryIO) -> Iterator[WrittenGeometry]:
    """Geometries of all city objects, in their order; a ring's repeated last point is taken off.

    Raises
    ------
    ValueError
        A ring is not closed, or a polygon is referred to that is not there.
    """
    for _, element in ElementTree.iterparse(source):
        if not element.tag.endswith("}cityObjectMember"):
            continue
        for city_object in element:
            polygons = {p.get(f"{GML}id", ""): p for p in city_object.iter(f"{GML}Polygon")}
            owner = city_object.findtext(f"{GML}name") or city_object.get(f"{GML}id") or ""
            yield from _geometries(city_object, owner, "", polygons)
        element.clear()


def _geometries(element: Element, owner: str, lod: str, polygons: Mapping[str, Element]) -> Iterator[WrittenGeometry]:
    """Geometries below an element; those that are parts of another one are left to it."""
    for child in element:
        name = child.tag.rpartition("}")[2]
        level = name[3] if name[:3] == "lod" and name[3:4].isdigit() else lod
        kind = _KINDS.get(child.tag)
        if kind is None:
            yield from _geometries(child, owner, level, polygons)
        else:
            yield WrittenGeometry(owner, kind, level or "terrain", tuple(_polygons(child, polygons)))


def _polygons(geometry: Element, polygons: Mapping[str, Element]) -> Iterator[Rings]:
    for part in geometry.iter():
        reference = part.get(f"{XLINK}href")
        if part.tag == f"{GML}surfaceMember" and reference is not None:
            if reference.removeprefix("#") not in polygons:
                raise ValueError(f"no polygon has the id {reference}")
            yield _rings(polygons[reference.removeprefix("#")])
        elif part.tag in (f"{GML}Polygon", f"{GML}Triangle"):
            yield _rings(part)


def _rings(polygon: Element) -> Rings:
    return tuple(_ring(text.text or "") for text in polygon.iter(f"{GML}posList"))


def _ring(text: str) -> FloatArray:
    points = np.array(text.split(), np.float64).reshape(-1, 3)
    if len(points) < 2 or (points[0] != points[-1]).any():
        raise ValueError(f"a ring of {len(points)} points is not closed")
    return points[:-1]
