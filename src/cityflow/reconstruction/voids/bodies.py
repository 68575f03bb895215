"""Parts that stand out before a façade above the ground: bay windows, upper storeys over a smaller one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from pydantic import Field
from scipy import ndimage
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.voids.seen_walls import Front, SeenWalls

CELL_M = 0.3
"""Cells that points before a façade are counted in; set by hand, as all here."""
BIN_M, PLANE_M = 0.1, 0.2
"""Distances from the façade are counted in such bins; points so near to the fullest are of one plane."""
OVER_GROUND_M = 1.2
"""What begins lower stands on the ground, and is of the outline."""
FULL = 0.6
"""Least share of a front's cells that have points."""
SIDE_M = 0.4
"""Side walls so near to the ends of a front tell where these are."""
OVERLAP_M = 0.1
"""A body reaches so far into the model, so that both are one."""
LEAST_ROOF_POINTS = 10
SAME_M = 0.3
"""A top so near to the roof behind it ends there."""
BEYOND_M = 0.2
"""What goes on farther beyond the ends of an edge is of a neighbour, or of another edge."""
UNDER_ROOF_M, BESIDE_CORNER_M = 0.02, 0.05
"""A body stays so far below the roof behind it, and away from the ends of its edge: no two planes are nearly one."""


class BodyParameters(Parameters):
    """What stands out before a façade."""

    min_points: int = Field(30, ge=4, le=10_000, description="fewest points of its front")
    min_width: float = Field(1.5, gt=0, le=50, description="narrowest front (m)")
    min_height: float = Field(2.0, gt=0, le=50, description="lowest front (m): railings are lower")
    min_depth: float = Field(0.5, gt=0, le=5, description="fronts nearer to the façade (m) are of the façade")
    max_depth: float = Field(2.5, gt=0, le=10, description="fronts farther from the façade (m) are of something else")


class Body(NamedTuple):
    """What stands out: local plan, world heights, and the number of points of its front."""

    polygon: Polygon
    low: float
    high: float
    points: int


class Box(NamedTuple):
    """Along an edge, outwards, and in height."""

    start: float
    end: float
    out: float
    low: float
    high: float


def find_bodies(seen: SeenWalls, roofs: PointCloud, parameters: BodyParameters) -> list[Body]:
    """Bodies before all edges that no neighbour touches.

    Parameters
    ----------
    roofs : points around the unit, world frame
    """
    tops = roofs.xyz - [*seen.origin, 0.0]
    found: list[Body] = []
    for edge in seen.edges:
        if edge.party or edge.length < parameters.min_width:
            continue
        for box, count in _boxes(seen, edge, parameters):
            high = _top(box, edge, tops, seen)
            shape = _plan(edge, box)
            if high - box.low >= parameters.min_height and not any(shape.intersects(b.polygon) for b in found):
                found.append(Body(shape, box.low, high, count))
    return found


def _boxes(seen: SeenWalls, edge: WallEdge, p: BodyParameters) -> Iterator[tuple[Box, int]]:
    for part in fronts(seen, edge, p):
        box = measured(seen, edge, part)
        if stands_free(box, seen, edge) and box.end - box.start >= p.min_width:
            yield box, len(part.s)


def stands_free(box: Box, seen: SeenWalls, edge: WallEdge) -> bool:
    """Whether it is over the ground, and of this edge alone."""
    # what stands before the whole façade is the façade, and the outline is wrong
    whole = box.end - box.start > 0.9 * edge.length
    ours = box.start > -BEYOND_M and box.end < edge.length + BEYOND_M
    return ours and not whole and box.low > seen.floor + OVER_GROUND_M + CELL_M


def fronts(seen: SeenWalls, edge: WallEdge, p: BodyParameters) -> Iterator[Front]:
    """Points before an edge that face as it does, for each plane and rectangle that is seen as a whole."""
    front = seen.front(edge)
    mine = (front.t > p.min_depth) & (front.t < p.max_depth) & (front.z > seen.floor + OVER_GROUND_M)
    mine &= (front.s > -CELL_M) & (front.s < edge.length + CELL_M)
    left = Front(front.s[mine], front.t[mine], front.z[mine])
    while len(left.s) >= p.min_points:
        counts = np.convolve(np.bincount((left.t / BIN_M).astype(int)), np.ones(3), "same")
        if counts.max() < p.min_points:
            return
        near = np.abs(left.t - (int(np.argmax(counts)) + 0.5) * BIN_M) <= PLANE_M
        plane = Front(left.s[near], left.t[near], left.z[near])
        for part in _parts(plane, p):
            yield Front(plane.s[part], plane.t[part], plane.z[part])
        left = Front(left.s[~near], left.t[~near], left.z[~near])


def _parts(plane: Front, p: BodyParameters) -> Iterator[BoolArray]:
    """Points of each rectangle that is seen as a whole."""
    s_0, z_0 = plane.s.min(), plane.z.min()
    column, row = ((plane.s - s_0) / CELL_M).astype(int), ((plane.z - z_0) / CELL_M).astype(int)
    seen = np.zeros((column.max() + 1, row.max() + 1), bool)
    seen[column, row] = True
    label, count = ndimage.label(seen)
    of = label[column, row]
    for k in range(1, count + 1):
        part = of == k
        if part.sum() < p.min_points:
            continue
        cells = label == k
        wide, high = (int(np.count_nonzero(cells.any(axis=a))) for a in (1, 0))
        if wide * CELL_M >= p.min_width and high * CELL_M >= p.min_height and cells.sum() >= FULL * wide * high:
            yield part


def measured(seen: SeenWalls, edge: WallEdge, part: Front) -> Box:
    """The box from an edge to a front, its ends by side walls where these are seen."""
    out = float(np.median(part.t))
    column = (part.s / CELL_M).astype(int)
    low = float(np.median([part.z[column == c].min() for c in np.unique(column)]))
    high = float(np.median([part.z[column == c].max() for c in np.unique(column)]))
    start, end = (float(v) for v in np.percentile(part.s, (0.5, 99.5)))
    return Box(
        _side(seen, edge, (start, out, low, high), -1.0), _side(seen, edge, (end, out, low, high), 1.0), out, low, high
    )


def _side(seen: SeenWalls, edge: WallEdge, near: tuple[float, float, float, float], way: float) -> float:
    """Where the side wall of a front stands along the edge; the end of the front where it is not seen."""
    s, out, low, high = near
    plan = seen.xyz[:, :2] - edge.start
    along, away, z = plan @ edge.along, plan @ edge.outward, seen.xyz[:, 2]
    mine = (seen.normal @ (way * edge.along) > 0.9) & (np.abs(along - s) < SIDE_M)
    mine &= (away > 0.15) & (away < out - 0.1) & (z > low) & (z < high)
    return float(np.median(along[mine])) if mine.sum() >= LEAST_ROOF_POINTS else s


def _top(box: Box, edge: WallEdge, tops: FloatArray, seen: SeenWalls) -> float:
    """Height of its roof: of the points on it, or where its front ends; no higher than the roof behind it."""
    plan = tops[:, :2] - edge.start
    s, t = plan @ edge.along, plan @ edge.outward
    over = (s > box.start + 0.2) & (s < box.end - 0.2) & (t > 0.2) & (t < box.out - 0.2) & (tops[:, 2] > box.high - 0.5)
    high = float(np.median(tops[over, 2])) if over.sum() >= LEAST_ROOF_POINTS else box.high
    at = np.linspace(box.start, box.end, 5)[1:-1, None]
    behind = float(min(seen.top(edge.start + at * edge.along - t * edge.outward).min() for t in (0.01, OVERLAP_M)))
    return min(high, behind - UNDER_ROOF_M) if high > behind - SAME_M else high


def _plan(edge: WallEdge, box: Box) -> Polygon:
    start, end = max(box.start, BESIDE_CORNER_M), min(box.end, edge.length - BESIDE_CORNER_M)
    corners = ((start, -OVERLAP_M), (end, -OVERLAP_M), (end, box.out), (start, box.out))
    return shapely.geometry.polygon.orient(
        Polygon([edge.start + s * edge.along + t * edge.outward for s, t in corners])
    )
