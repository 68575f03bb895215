"""A geometry of an exported file, independent of the format: polygons by their rings, and their type."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from cityflow.core.arrays import FloatArray


class GeometryKind(StrEnum):
    """What polygons together are, by the names that CityJSON and GML share."""

    MULTI_SURFACE = "MultiSurface"
    COMPOSITE_SURFACE = "CompositeSurface"
    SOLID = "Solid"


@dataclass(frozen=True, slots=True)
class WrittenGeometry:
    """One geometry of one object.

    Attributes
    ----------
    owner : id of the object
    lod : level of detail, as written
    polygons : of the outer shell of a solid, else all; rings of each, exterior first, (n, 3) float64 world metres, without the repeated last point
    """

    owner: str
    kind: GeometryKind
    lod: str
    polygons: tuple[tuple[FloatArray, ...], ...]
