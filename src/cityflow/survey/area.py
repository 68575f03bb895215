"""The area of interest: it limits the tiles and units of a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import shapely
from shapely.geometry.base import BaseGeometry

from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.tables.vector import read_polygons


@dataclass(frozen=True, slots=True)
class Area:
    """Polygons in the world frame; None is everywhere."""

    shape: BaseGeometry | None = None

    @property
    def is_everywhere(self) -> bool:
        return self.shape is None

    @property
    def wkt(self) -> str | None:
        return None if self.shape is None else str(shapely.to_wkt(self.shape, rounding_precision=-1))

    @classmethod
    def of_wkt(cls, text: str | None) -> Area:
        return cls(None if text is None else shapely.from_wkt(text))

    def meets(self, bounds: Bounds) -> bool:
        return self.shape is None or bool(self.shape.intersects(shapely.box(*bounds)))

    def covers(self, bounds: Bounds) -> bool:
        """Whether all of a rectangle is inside."""
        return self.shape is None or bool(self.shape.covers(shapely.box(*bounds)))

    def holds(self, point: tuple[float, float]) -> bool:
        return self.shape is None or bool(shapely.intersects_xy(self.shape, *point))


EVERYWHERE = Area()


def parse_area(text: str, reference: Reference) -> Area:
    """``x_min,y_min,x_max,y_max`` in the run's CRS, or a vector file of polygons (reprojected).

    Raises
    ------
    CatalogError
        Neither four ascending numbers nor a readable file of polygons.
    """
    if not text:
        return EVERYWHERE
    if Path(text).exists():
        return Area(shapely.union_all(read_polygons(text, reference)))
    try:
        x_min, y_min, x_max, y_max = (float(part) for part in text.split(","))
    except ValueError:
        x_min = x_max = y_min = y_max = 0.0
    if not (x_min < x_max and y_min < y_max):
        raise CatalogError(
            f"'{text}' is neither a file nor four ascending numbers",
            where="--aoi",
            remedy="give a vector file, or x_min,y_min,x_max,y_max in the run's CRS",
        )
    return Area(shapely.box(x_min, y_min, x_max, y_max))
