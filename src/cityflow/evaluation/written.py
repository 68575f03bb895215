"""Validity of exported files by ISO 19107: solids, surfaces, walls with openings, terrain."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from cityflow.core.written_geometry import GeometryKind, WrittenGeometry
from cityflow.geometry.faults import Fault
from cityflow.geometry.validity import check_polygons, check_surface


@dataclass(frozen=True, slots=True)
class FaultyGeometry:
    """A geometry that breaks rules, and which; its faces are counted as in the file."""

    geometry: WrittenGeometry
    faults: tuple[Fault, ...]


def faults_of(geometry: WrittenGeometry) -> list[Fault]:
    """Rules that a geometry breaks: all of a shell for solids and composite surfaces, those of single polygons for the rest."""
    if geometry.kind is GeometryKind.MULTI_SURFACE:
        return check_polygons(geometry.polygons)
    return check_surface(geometry.polygons, closed=geometry.kind is GeometryKind.SOLID)


def faulty(geometries: Iterable[WrittenGeometry]) -> list[FaultyGeometry]:
    """Those that break a rule, in their order."""
    return [FaultyGeometry(g, tuple(found)) for g in geometries if (found := faults_of(g))]


def counted(found: Iterable[FaultyGeometry]) -> Counter[tuple[str, str, str]]:
    """Geometries by kind, level of detail and rule broken; one that breaks several counts for each."""
    return Counter(
        (f.geometry.kind.value, f.geometry.lod, name)
        for f in found
        for name in {str(x.code) + " " + x.name for x in f.faults}
    )
