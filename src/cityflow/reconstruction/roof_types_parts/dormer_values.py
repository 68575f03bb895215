"""A slope that may carry dormers, and a dormer on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.roof_types_parts.roof_model import PlacedSkeleton, RoofModel

MOST_PLACES, MOST_LINES, MOST_MEASURED = 40_000, 30, 200
"""Places, lines and dormers that are looked at; bounds time."""

LEAST_SLOPE_DEG = 22.0
"""Slopes less steep carry no dormers, degrees; set by hand, as are those below."""
UNDER_RIDGE_M = 0.15
"""Dormers stay so far below the top of their slope, m."""
LEAST_EVIDENCE = 1.5
"""Log-likelihood that heights, and lines, speak for a dormer, at least."""
NARROWEST_M, WIDEST_M, SHORTEST_M = 1.4, 4.5, 1.2
"""Widths of dormers, and how far they run into the slope at least, m."""


class DormerParameters(Parameters):
    """What a dormer is."""

    most: int = Field(12, ge=0, le=100, description="most dormers of a slope; 0: none are sought")
    cost: float = Field(0.0, ge=0, le=50, description="cost of a dormer beyond its numbers")


@dataclass(frozen=True, slots=True)
class Slope:
    """One plane of the roof in its own frame.

    Attributes
    ----------
    frame : (2, 2) float64, unit vectors along the eave and up the slope
    plane : (3,) float64, a, b, c
    region : where it counts
    top : metres, its highest place
    """

    frame: FloatArray
    plane: FloatArray
    region: Polygon
    top: float

    @property
    def steep(self) -> float:
        return float(np.hypot(*self.plane[:2]))

    def height(self, u: float, v: float) -> float:
        return float(self.plane[:2] @ (u * self.frame[0] + v * self.frame[1]) + self.plane[2])


@dataclass(frozen=True, slots=True)
class Dormer:
    """Numbers (6,), see above, what heights and lines say of it, and the part that it is."""

    numbers: FloatArray
    heights: float
    lines: float
    part: PlacedSkeleton


def slopes_of(model: RoofModel, outline: Polygon) -> list[Slope]:
    """Planes steep and large enough to carry dormers, each with the region where it counts."""
    x0, y0, x1, y1 = outline.bounds
    step = max(0.25, math.sqrt((x1 - x0) * (y1 - y0) / MOST_PLACES))
    x, y = np.meshgrid(np.arange(x0 + step / 2, x1, step), np.arange(y0 + step / 2, y1, step))
    xy = np.column_stack([x.ravel(), y.ravel()])
    xy = xy[shapely.contains_xy(outline, xy[:, 0], xy[:, 1])]
    label = model.labels(xy)
    found = []
    for number, plane in enumerate(model.planes):
        steep = float(np.hypot(*plane[:2]))
        own = xy[label == number]
        if steep < math.tan(math.radians(LEAST_SLOPE_DEG)) or len(own) * step**2 < 6.0:
            continue
        up = plane[:2] / steep
        squares = shapely.box(*(own - step / 2).T, *(own + step / 2).T)
        region = shapely.union_all(squares, grid_size=1e-3).buffer(step).buffer(-step)
        parts = [p for p in shapely.get_parts(region) if p.geom_type == "Polygon"]
        region = max(parts, key=lambda p: p.area)
        top = float((own @ plane[:2]).max() + plane[2])
        found.append(Slope(np.array([[up[1], -up[0]], up]), plane, region, top))
    return found
