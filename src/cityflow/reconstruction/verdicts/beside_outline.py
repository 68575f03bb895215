"""What stands beside an outline in the surface of images: holes, and roofs of other units at another height.

Where a surface ends at a hole, nobody knows whether the roof goes on: terrain is interpolated there. Where roofs of different height touch, matching
draws a slope between them, which its own points confirm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Polyhedron
from cityflow.core.facade_points import WallPoints
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.geometry.roof_distances import NEAR
from cityflow.reconstruction.verdicts.roof_parts import planes_at

ALONG_M, BEYOND_M = 0.25, tuple(0.2 * k for k in range(1, 11))
"""Places beside an outline: along it, and so far outside; set by hand, as are those below."""
FACADE_M, FACING = 0.6, 0.7
"""A façade is seen where points that face outwards (cosine) are this near in plan."""
STRIP_M = 1.0
"""Slopes between two roofs are not wider, to each side of the border."""
INSIDE_M = 1.6
"""So far inside a border the roof is itself."""
ACROSS_M = (0.8, 1.2, 1.6)
"""The neighbour's roof is the middle height so far beyond the border."""
STEP_M = 0.4
"""Roofs that differ less in height at their border have no step: most of a slope between them is within 20 cm of both."""


@dataclass(frozen=True, slots=True)
class Borders:
    """Shares of a roof's area or rim, all of matched surfaces; 0 where there is no surface.

    Attributes
    ----------
    holed : of the rim that no other unit touches, beside which the surface is unknown as far as is looked, and where no façade is seen
    ramped : of the roof, beside another unit, where the model leaves the plane that the roof has further in, towards the other roof
    stepped : of the roof, so near to another unit that a slope of matching is likely, where that unit's roof is at another height
    """

    holed: float = 0.0
    ramped: float = 0.0
    stepped: float = 0.0


def borders_of(solid: Polyhedron, evidence: Evidence, face: IntArray, places: FloatArray) -> Borders:
    """What stands beside a unit.

    Parameters
    ----------
    face : (P,) number of the roof face at each place, -1 where there is none
    places : (P, 2) all over the outline in plan, evenly spaced
    """
    if evidence.heights is None:
        return Borders()
    ramped, stepped = _at_borders(solid, evidence, evidence.heights, face, places)
    return Borders(holed_share(evidence, evidence.heights), ramped, stepped)


def holed_share(evidence: Evidence, heights: HeightRaster) -> float:
    """Share of the free rim of an outline beside which nothing of the surface is known, and no façade: the roof may go on there."""
    rim = evidence.outline.exterior
    if evidence.party:
        rim = rim.difference(shapely.union_all(list(evidence.party)).buffer(STRIP_M))
    if rim.is_empty or rim.length < ALONG_M:
        return 0.0
    lines = [shapely.segmentize(part, ALONG_M) for part in shapely.get_parts(rim)]
    found = []
    for line in lines:
        xy = shapely.get_coordinates(line)
        middle, along = (xy[1:] + xy[:-1]) / 2, xy[1:] - xy[:-1]
        length = np.linalg.norm(along, axis=1)
        outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.maximum(length, 1e-9)[:, None]
        out = shapely.contains_xy(evidence.outline, *(middle + 0.01 * outward).T)
        outward[out] *= -1.0
        unknown = np.all([np.isnan(at(heights, heights.dsm, middle + far * outward)) for far in BEYOND_M], axis=0)
        unknown[unknown] = ~_facade_seen(evidence.walls, middle[unknown], outward[unknown])
        found.append(np.column_stack([length, unknown]))
    table = np.concatenate(found)
    return float(table[:, 0] @ table[:, 1] / table[:, 0].sum())


def _facade_seen(walls: WallPoints, xy: FloatArray, outward: FloatArray) -> BoolArray:
    """(N,) whether images show a façade that faces outwards near places of a rim."""
    if not len(walls) or not len(xy):
        return np.zeros(len(xy), bool)
    near = cKDTree(walls.xyz[:, :2]).query_ball_point(xy, FACADE_M)
    return np.array([bool((walls.normal[k] @ out > FACING).any()) for k, out in zip(near, outward, strict=True)])


def at(heights: HeightRaster, layer: FloatArray, xy: FloatArray) -> FloatArray:
    """(N,) values of a layer at places; NaN beyond it."""
    row, col = heights.grid.indices(xy[:, 0], xy[:, 1])
    rows, cols = heights.grid.shape
    inside = (row >= 0) & (col >= 0) & (row < rows) & (col < cols)
    return np.where(inside, layer[np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)], np.nan)


def _at_borders(
    solid: Polyhedron, evidence: Evidence, heights: HeightRaster, face: IntArray, places: FloatArray
) -> tuple[float, float]:
    """Shares `ramped` and `stepped`."""
    if not evidence.party:
        return 0.0, 0.0
    border = shapely.union_all(list(evidence.party))
    away = shapely.distance(shapely.points(places), border)
    near = np.flatnonzero((away < STRIP_M) & (away > 0) & (face >= 0))
    if not len(near):
        return 0.0, 0.0
    foot = shapely.get_coordinates(shapely.shortest_line(border, shapely.points(places[near]))).reshape(-1, 2, 2)[:, 0]
    inward = (places[near] - foot) / away[near, None]
    inner = _face_at(face, places, foot + INSIDE_M * inward, evidence.outline)
    known = inner >= 0
    plane = np.full(len(near), np.nan)
    plane[known] = planes_at(solid, inner[known], places[near][known])
    at_border = np.full(len(near), np.nan)
    at_border[known] = planes_at(solid, inner[known], foot[known])
    # a ridge along the border would bend the plane; what is compared is the step at the border itself
    beyond = np.array([at(heights, heights.dsm, foot - far * inward) for far in ACROSS_M])
    other = np.full(len(near), np.nan)
    seen = np.isfinite(beyond).any(axis=0)
    other[seen] = np.nanmedian(beyond[:, seen], axis=0)
    step = other - at_border
    own = planes_at(solid, face[near], places[near])
    towards = (np.abs(own - plane) > NEAR) & (np.sign(own - plane) == np.sign(step)) & (np.abs(step) > STEP_M)
    close = (away[near] < NEAR) & (np.abs(step) > STEP_M)
    return float(towards.sum()) / len(places), float(close.sum()) / len(places)


def _face_at(face: IntArray, places: FloatArray, xy: FloatArray, outline: Polygon) -> IntArray:
    """(N,) the face at the nearest place, -1 outside the outline."""
    found = face[cKDTree(places).query(xy)[1]]
    inside: BoolArray = shapely.contains_xy(outline, xy[:, 0], xy[:, 1])
    return np.where(inside, found, -1)
