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


class DormerParameters(Parameters):
    """What a dormer is."""

    most: int = Field(12, ge=0, le=100, description="most dormers of a slope; 0: none are sought")
    narrowest_m: float = Field(1.4, gt=0, le=10, description="width of the narrowest (m)")
    widest_m: float = Field(4.5, gt=0, le=50, description="width of the widest (m)")
    shortest_m: float = Field(1.2, gt=0, le=10, description="they run at least so far into the slope (m)")
    least_slope_deg: float = Field(22.0, ge=5, le=80, description="slopes less steep (degrees) carry none")
    under_ridge_m: float = Field(0.15, ge=0, le=5, description="they stay so far below the top of their slope (m)")
    cost: float = Field(0.0, ge=0, le=50, description="cost of a dormer beyond its numbers")
    least_heights: float = Field(1.5, ge=0, le=50, description="log-likelihood that heights speak for it, at least")
    least_lines: float = Field(1.5, ge=-10, le=50, description="log-likelihood that lines speak for it, at least")


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


def slopes_of(model: RoofModel, outline: Polygon, parameters: DormerParameters) -> list[Slope]:
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
        if steep < math.tan(math.radians(parameters.least_slope_deg)) or len(own) * step**2 < 6.0:
            continue
        up = plane[:2] / steep
        squares = shapely.box(*(own - step / 2).T, *(own + step / 2).T)
        region = shapely.union_all(squares, grid_size=1e-3).buffer(step).buffer(-step)
        parts = [p for p in shapely.get_parts(region) if p.geom_type == "Polygon"]
        region = max(parts, key=lambda p: p.area)
        top = float((own @ plane[:2]).max() + plane[2])
        found.append(Slope(np.array([[up[1], -up[0]], up]), plane, region, top))
    return found
