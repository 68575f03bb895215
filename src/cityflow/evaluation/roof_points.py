"""Distances of measured points from roof models: the common measure of methods and cities.

Points inside the outlines shrunk by a margin, against the topmost roof polygon at their x, y, vertically. The margin keeps
out points of walls, gutters and neighbours, which say nothing of the roof.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from shapely import Polygon, contains_xy, prepare

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.geometry.roof_distances import RoofDistances, distances_to_roof, summarise

MARGIN = 0.3
"""How far (m) the outlines are shrunk."""


def roof_point_score(units: Iterable[tuple[Polygon, Polyhedron | None, FloatArray]]) -> RoofDistances:
    """Score of many units together.

    Parameters
    ----------
    units : outline (world), its solid or None, and the (N, 3) building points around it; a unit without a solid counts
        as not covered
    """
    parts = [unit_distances(*unit) for unit in units]
    return summarise(np.concatenate(parts) if parts else np.empty(0))


def unit_distances(outline: Polygon, solid: Polyhedron | None, xyz: FloatArray) -> FloatArray:
    """(M,) heights above the model of the points well inside the outline; NaN where there is no roof."""
    inner = xyz[inner_points(outline, xyz)]
    return np.full(len(inner), np.nan) if solid is None else distances_to_roof(solid, inner)


def inner_points(outline: Polygon, xyz: FloatArray, margin: float = MARGIN) -> BoolArray:
    """(N,) mask of the points inside the outline shrunk by `margin` metres."""
    inner = outline.buffer(-margin)
    prepare(inner)
    return np.asarray(contains_xy(inner, xyz[:, 0], xyz[:, 1]))
