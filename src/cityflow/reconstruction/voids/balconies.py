"""Balconies: low fronts before a façade that is seen above and below them. They are surfaces beside the solid, as far as points show them."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS, Face, Installation, Polyhedron, Semantic
from cityflow.core.points import PointCloud
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.voids.bodies import LEAST_ROOF_POINTS, BodyParameters, Box, fronts, measured, stands_free
from cityflow.reconstruction.voids.facade_gaps import COLUMN_M, ON_M
from cityflow.reconstruction.voids.face_points import with_face_points
from cityflow.reconstruction.voids.seen_walls import SeenWalls

ABOVE_M, BELOW_M = (0.1, 1.5), (0.2, 2.5)
"""The façade is looked for so far over a front and below it; set by hand, as all here."""
SEEN_ABOVE, SEEN_BELOW = 0.5, 0.3
"""Least share of the width over and below a front where the façade is seen; a balcony hides some of what is below it."""
RIM_M = 0.2
"""Points so near to a rim are of the rim."""
FLOOR_BELOW_M = 0.3
"""A floor lies so far below the upper end of its front at least."""
LEVEL_M = 0.15
"""Points that differ less from their median are of one floor, if most do."""


class BalconyParameters(BodyParameters):
    """Low fronts before a façade."""

    min_points: int = Field(15, ge=4, le=10_000, description="fewest points of its front")
    min_height: float = Field(0.6, gt=0, le=50, description="lowest front (m)")
    max_height: float = Field(1.8, gt=0, le=50, description="highest front (m)")


def find_balconies(seen: SeenWalls, roofs: PointCloud, parameters: BalconyParameters) -> tuple[Installation, ...]:
    """Balconies before all edges that no neighbour touches, edge by edge, from below.

    Parameters
    ----------
    roofs : points around the unit, world frame
    """
    p = parameters
    level = np.concatenate([roofs.xyz - [*seen.origin, 0.0], seen.level])
    found = []
    for edge in seen.edges:
        if edge.party or edge.length < p.min_width:
            continue
        shown = [(measured(seen, edge, part), len(part.s)) for part in fronts(seen, edge, p)]
        for box, points in sorted(shown, key=lambda row: (row[0].low, row[0].start)):
            if stands_free(box, seen, edge) and _fits(box, p) and _before_facade(box, seen, edge):
                surfaces = with_face_points(_surfaces(box, edge, _floor(box, edge, level), seen), seen, roofs)
                found.append(Installation("balcony", surfaces, points))
    return tuple(found)


def _fits(box: Box, p: BalconyParameters) -> bool:
    return box.end - box.start >= p.min_width and p.min_height <= box.high - box.low <= p.max_height


def _before_facade(box: Box, seen: SeenWalls, edge: WallEdge) -> bool:
    """Whether the façade is seen over it and below it: over eaves and walls in a garden it is not, or not below."""
    front = seen.front(edge)
    on = (np.abs(front.t) <= ON_M) & (front.s > box.start) & (front.s < box.end)
    column, z = ((front.s[on] - box.start) / COLUMN_M).astype(int), front.z[on]
    count = max(1, int((box.end - box.start) / COLUMN_M))
    above = (z > box.high + ABOVE_M[0]) & (z < box.high + ABOVE_M[1])
    below = (z < box.low - BELOW_M[0]) & (z > box.low - BELOW_M[1])
    shares = [len(np.unique(column[rows])) / count for rows in (above, below)]
    return shares[0] >= SEEN_ABOVE and shares[1] >= SEEN_BELOW


def _floor(box: Box, edge: WallEdge, level: FloatArray) -> float | None:
    """World height of its floor; None where that is not seen."""
    plan = level[:, :2] - edge.start
    s, t, z = plan @ edge.along, plan @ edge.outward, level[:, 2]
    mine = (s > box.start + RIM_M) & (s < box.end - RIM_M) & (t > RIM_M) & (t < box.out - RIM_M)
    heights = z[mine & (z > box.low - RIM_M) & (z < box.high - FLOOR_BELOW_M)]
    if len(heights) < LEAST_ROOF_POINTS:
        return None
    middle = float(np.median(heights))
    return max(middle, box.low) if np.mean(np.abs(heights - middle) <= LEVEL_M) > 0.5 else None


def _surfaces(box: Box, edge: WallEdge, floor: float | None, seen: SeenWalls) -> Polyhedron:
    """Front, sides, underside at the lower end of the front, and the floor where it is seen; world frame."""

    def at(s: float, t: float, z: float) -> FloatArray:
        return np.append(seen.origin + edge.start + s * edge.along + t * edge.outward, z)

    def level(z: float) -> list[FloatArray]:
        return [at(s, t, z) for s, t in ((box.start, 0), (box.end, 0), (box.end, box.out), (box.start, box.out))]

    up = np.array([0.0, 0.0, 1.0])
    low, high = level(box.low), level(box.high)
    drawn = [(Semantic.WALL, [low[3], low[2], high[2], high[3]], np.append(edge.outward, 0.0))]
    for (near, far), way in (((0, 3), -edge.along), ((1, 2), edge.along)):
        drawn.append((Semantic.WALL, [low[near], low[far], high[far], high[near]], np.append(way, 0.0)))
    drawn.append((Semantic.OUTER_CEILING, low, -up))
    if floor is not None:
        drawn.append((Semantic.OUTER_FLOOR, level(floor), up))
    corners = np.round(np.concatenate([_facing(np.array(ring), normal) for _, ring, normal in drawn]), VERTEX_DECIMALS)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    rings = index.reshape(-1, 4).tolist()
    return Polyhedron(
        vertices,
        tuple(Face((tuple(ring),), kind, points=0) for ring, (kind, _, _) in zip(rings, drawn, strict=True)),
    )


def _facing(ring: FloatArray, normal: FloatArray) -> FloatArray:
    """(4, 3) the ring so that it runs counter-clockwise where its normal points."""
    across = np.cross(ring[1] - ring[0], ring[2] - ring[1])
    return ring if across @ normal > 0 else ring[::-1]
