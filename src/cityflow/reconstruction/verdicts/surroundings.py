"""Surroundings of a unit compared with its extended roof planes: eaves, continuing roofs, façades."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.outline_distances import distances_to_outline
from cityflow.geometry.roof_distances import NEAR
from cityflow.reconstruction.verdicts.roof_fit import RoofFit
from cityflow.reconstruction.verdicts.roof_parts import planes_at

BESIDE_M = (1.0, 2.0)
"""Where a roof that goes on beyond the outline would have points; nearer are eaves; set by hand, as are those below."""
SEEN_SPACINGS, SEEN_M = 1.2, (0.3, 3.0)
"""A place is seen where a roof point is within this many spacings of points, within bounds; evenly strewn points leave out one place of a hundred."""
BELOW_M = 0.5
"""What is so far below the roof's plane may be its wall."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The points in and around an outline.

    Attributes
    ----------
    xyz : (N, 3) world
    above : (N,) metres above the plane of the nearest roof, which may end before; NaN where there is none
    outside : (N,) metres from the outline; 0 within it, NaN for points off the roof's plane
    roof : (M, 3) the points that the roof explains
    facades : points of façades that images show, without those that stand as high as the roof: its rim, or a tree
    """

    xyz: FloatArray
    above: FloatArray
    outside: FloatArray
    roof: FloatArray
    facades: WallPoints

    @property
    def continuing(self) -> BoolArray:
        """(N,) points beyond the outline in the plane of the roof."""
        return np.asarray((self.outside > 0) & (np.abs(self.above) <= NEAR))

    @property
    def below(self) -> BoolArray:
        """(N,) points that may be a façade's."""
        return np.asarray(self.above < -BELOW_M)


def surroundings_of(solid: Polyhedron, evidence: Evidence, fit: RoofFit) -> Surroundings:
    """The surroundings of a unit whose own points are held against its model already."""
    roof, xyz = evidence.points.xyz[fit.explained], evidence.around.xyz
    if not len(roof) or not len(xyz):
        none = np.empty(0)
        return Surroundings(np.empty((0, 3)), none, none, roof, joined_walls(()))
    tree, face = cKDTree(roof[:, :2]), fit.face[fit.explained]

    def above_roof(of: FloatArray) -> FloatArray:
        return np.asarray(of[:, 2] - planes_at(solid, face[tree.query(of[:, :2])[1]], of[:, :2]))

    above, outside = above_roof(xyz), np.full(len(xyz), np.nan)
    near = np.abs(above) <= NEAR
    outside[near] = distances_to_outline(evidence.outline, xyz[near])
    seen = evidence.walls
    facades = seen.take(above_roof(seen.xyz) < -BELOW_M) if len(seen) else seen
    return Surroundings(xyz, above, outside, roof, facades)


def beside_of(evidence: Evidence, around: Surroundings, density: float) -> float:
    """Density of points that continue the roof beyond the outline, where no other unit stands, by that of the roof's."""
    on = around.continuing & (around.outside <= BESIDE_M[1])
    bridge, outside = (
        around.xyz[m, :2] for m in (on & (around.outside <= BESIDE_M[0]), on & (around.outside > BESIDE_M[0]))
    )
    if not len(bridge) or not len(outside):
        return 0.0
    ring = evidence.outline.buffer(BESIDE_M[1]).difference(evidence.outline.buffer(BESIDE_M[0]))
    if evidence.party:
        ring = ring.difference(shapely.union_all([p.buffer(BESIDE_M[1] + 1.0) for p in evidence.party]))
        outside = outside[shapely.contains_xy(ring, outside[:, 0], outside[:, 1])]
    if ring.area < 1.0 or not len(outside):
        return 0.0
    # what goes on without a gap; a neighbour across a gap of the same shape does not
    reach = max(BESIDE_M[1] - BESIDE_M[0], SEEN_SPACINGS / math.sqrt(density))
    joined = cKDTree(bridge).query(outside)[0] <= reach
    return min(float(joined.sum()) / ring.area / density, 2.0)
