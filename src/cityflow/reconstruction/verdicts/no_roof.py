"""Points that are no roof: echoes of façades, of objects on or above a roof, of objects below it.

They say nothing of the roof, so they leave its RMSE and its share explained, and are counted apart. A point is excused only if it is far from the
model and no part of a patch that looks like a roof: points that lie together on a plane that is not upright are a structure that the model lacks
(a dormer, an upper storey, a terrace), and stay.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.geometry.roof_distances import NEAR
from cityflow.reconstruction.verdicts.roof_parts import ends_in_plan

WALL_M = 0.5
"""Points this near to a wall in plan, and below its top, may be of it: the outline's error, a sill, a gutter, a scanner's spot; set by hand, as are
those below."""
FAR_M = 1.0
"""Lone points this far above or below a roof are no part of it."""
LOW_M = 2.5
"""What is no higher above the floor than this is a car, a shed, a hedge."""
PATCH_POINTS = 6
"""Of a patch: twice those of a plane."""
PATCH_REACH = 2.0
"""The points of a patch lie within this many spacings of points."""
PATCH_ROUGHNESS_M, PATCH_NOISE, PATCH_WIDTH_M = 0.06, 2.0, 0.08
"""Standard deviations of a patch's points: across its plane at most (metres, or so many times the noise), along its shorter side at least."""
MOST = 0.5
"""Of the patches that hold a point: the majority."""
UPRIGHT_COS = float(np.cos(np.radians(72.0)))
"""Steeper patches are walls, as for the planes of roofs."""


class Kind(IntEnum):
    """What a point of a unit is."""

    ROOF = 0
    FACADE = 1
    ABOVE = 2
    BELOW = 3
    LOW = 4


NAMES = {Kind.FACADE: "facade", Kind.ABOVE: "above_roof", Kind.BELOW: "below_roof", Kind.LOW: "near_ground"}


def kinds_of(
    solid: Polyhedron, xyz: FloatArray, distance: FloatArray, floor: float, density: float, noise: float
) -> IntArray:
    """(N,) `Kind` of each point.

    Parameters
    ----------
    xyz : (N, 3) world, metres;  distance : (N,) height above the topmost roof there, metres, NaN where there is none
    floor : height of the solid's floor, metres
    density : points per square metre of the roof
    noise : metres, standard deviation of the points that the roof explains
    """
    kinds = np.full(len(xyz), Kind.ROOF, np.int64)
    off = np.flatnonzero(~(np.abs(distance) <= NEAR))
    if not len(off):
        return kinds
    single = ~_on_patches(xyz[off], density, noise)
    alone, d = off[single], distance[off[single]]
    kinds[alone[d > FAR_M]] = Kind.ABOVE
    low = xyz[alone, 2] - floor < LOW_M
    kinds[alone[(d < -FAR_M) & ~low]] = Kind.BELOW
    kinds[alone[(d < -FAR_M) & low]] = Kind.LOW
    kinds[alone[_at_walls(solid, xyz[alone])]] = Kind.FACADE
    return kinds


def _on_patches(xyz: FloatArray, density: float, noise: float) -> BoolArray:
    """(N,) whether a point lies with its neighbours on a plane that is not upright, or beside those that do and in their plane."""
    if len(xyz) < PATCH_POINTS:
        return np.zeros(len(xyz), bool)
    reach = PATCH_REACH * np.sqrt(PATCH_POINTS / (np.pi * max(density, 1e-6)))
    rough = max(PATCH_ROUGHNESS_M, PATCH_NOISE * noise)
    far, near = cKDTree(xyz).query(xyz, PATCH_POINTS)
    middle = xyz[near].mean(axis=1)
    patch = xyz[near] - middle[:, None]
    value, vector = np.linalg.eigh(np.einsum("nki,nkj->nij", patch, patch) / PATCH_POINTS)
    extent, normal = np.sqrt(np.maximum(value, 0.0)), vector[:, :, 0]
    level = (extent[:, 0] <= rough) & (extent[:, 1] >= PATCH_WIDTH_M) & (far[:, -1] <= reach)
    level &= np.abs(normal[:, 2]) >= UPRIGHT_COS
    # chance lays a few leaves on a plane, but not most of the patches that hold a leaf
    held = np.bincount(near.ravel(), minlength=len(xyz))
    member = np.bincount(near[level].ravel(), minlength=len(xyz)) >= MOST * held
    solid = np.flatnonzero(level & member)
    rest = np.flatnonzero(~member)
    if len(solid) and len(rest):
        apart, which = cKDTree(middle[solid]).query(xyz[rest])
        off = np.abs(((xyz[rest] - middle[solid[which]]) * normal[solid[which]]).sum(axis=1))
        member[rest] = (apart <= reach) & (off <= 2 * rough)
    return np.asarray(member)


def _at_walls(solid: Polyhedron, xyz: FloatArray) -> BoolArray:
    """(N,) whether a wall of the model stands beside a point in plan and reaches higher than it."""
    rings = [solid.ring(f.rings[0]) for f in solid.of_semantic(Semantic.WALL)]
    found = np.zeros(len(xyz), bool)
    if not rings or not len(xyz):
        return found
    walls = shapely.linestrings([ends_in_plan(r) for r in rings])
    low, top = (np.array([f(r[:, 2]) for r in rings]) for f in (np.min, np.max))
    spots = shapely.points(xyz[:, :2])
    point, wall = shapely.STRtree(walls).query(spots, predicate="dwithin", distance=WALL_M)
    z = xyz[point, 2]
    found[point[(z > low[wall] - NEAR) & (z < top[wall] - NEAR)]] = True
    return found
