"""What is seen of a unit's walls: points of its façades, and points that its model hides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import roof_hits
from cityflow.geometry.straight_edges import WallEdge, wall_edges
from cityflow.reconstruction.extruded import moved

FRONT_M, BELOW_M = 0.35, 0.5
"""A point is hidden where the model is solid so far in front of it, and so far up from there; set by hand, as all here."""
INSIDE_M = 0.3
"""Points nearer to the outline are of its façades, or of windows in them."""
FACING = float(np.cos(np.radians(25.0)))
"""Cosine of the largest angle between a point's normal and that of its wall."""


class Front(NamedTuple):
    """Points of walls in the frame of one edge of the outline.

    Attributes
    ----------
    s, t : (N,) metres along the edge, and outwards
    z : (N,) world height, metres
    """

    s: FloatArray
    t: FloatArray
    z: FloatArray


@dataclass(frozen=True, slots=True)
class SeenWalls:
    """Walls as they are seen; plan in metres from a local origin, heights in world metres.

    Attributes
    ----------
    solid : the model, world frame;  origin : world plan coordinates of the local origin
    outline : local;  edges : its straight edges, local
    floor : world height
    xyz, normal : (N, 3), (N, 2) points on walls, and unit vectors towards those who see them
    hidden : (N,) bool, the points that the model hides
    level : (M, 3) points of level surfaces under something that is solid in the model
    """

    solid: Polyhedron
    origin: FloatArray
    outline: Polygon
    edges: tuple[WallEdge, ...]
    floor: float
    xyz: FloatArray
    normal: FloatArray
    hidden: BoolArray
    level: FloatArray

    def front(self, edge: WallEdge) -> Front:
        """Points whose normal is that of an edge, in its frame."""
        facing = self.normal @ edge.outward >= FACING
        at = self.xyz[facing]
        plan = at[:, :2] - edge.start
        return Front(plan @ edge.along, plan @ edge.outward, at[:, 2])

    def before_hidden(self) -> FloatArray:
        """(K, 3) open places a little in front of the hidden points."""
        ahead = np.column_stack([FRONT_M * self.normal[self.hidden], np.zeros(int(self.hidden.sum()))])
        return np.asarray(self.xyz[self.hidden] + ahead)

    def top(self, plan: FloatArray) -> FloatArray:
        """(N,) world height of the model's roof over places (N, 2), −∞ where there is none."""
        return _top(self.solid, plan + self.origin)


def seen_walls(solid: Polyhedron, evidence: Evidence) -> SeenWalls:
    """Points of the unit's evidence, parted into those on façades and those that the model hides."""
    origin = np.floor(np.array(evidence.outline.bounds[:2]))
    outline = moved(evidence.outline, -origin[0], -origin[1])
    party = [LineString(shapely.get_coordinates(p) - origin) for p in evidence.party]
    xyz, normal = evidence.walls.xyz, evidence.walls.normal.astype(np.float64)
    floor = evidence.ground_height
    local = xyz - [*origin, 0.0]
    within = shapely.buffer(outline, -INSIDE_M)
    shapely.prepare(within)
    inside = shapely.contains_xy(within, *local[:, :2].T) & (xyz[:, 2] > floor)
    hidden = inside.copy()
    hidden[inside] = _top(solid, xyz[inside, :2] + FRONT_M * normal[inside]) > xyz[inside, 2] + BELOW_M
    level = evidence.covered
    level = level[_top(solid, level[:, :2]) > level[:, 2] + BELOW_M] if len(level) else level
    return SeenWalls(
        solid, origin, outline, tuple(wall_edges(outline, party)), floor, local, normal, hidden, level - [*origin, 0.0]
    )  # fmt: skip


def _top(solid: Polyhedron, plan: FloatArray) -> FloatArray:
    height = roof_hits(solid, np.column_stack([plan, np.zeros(len(plan))]))[1]
    return np.where(np.isfinite(height), -height, -np.inf)
