"""Height of the wall base along walls, by sections: at the ground, or at a lower roof in front."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.outlines.from_walls.wall_line import Heights, WallLine

SECTION_M = 0.5
"""The base of a wall is looked for every so many metres; set by hand on synthetic towns, as are those below."""
_NEAR_M = 0.4
"""Among points this near."""
_SAME_SIDE = 0.7
"""Whose normals turn less than 45 degrees from the wall's."""
_LEAST_POINTS = 5
"""Fewer tell no base."""
_LOWEST = 0.05
"""The quantile of their heights that is the base: a few stray below it."""
_BEFORE_M = 0.5
"""The ground is read so far before the wall."""


@dataclass(frozen=True, slots=True)
class KnownWall:
    """A wall, and how high above the terrain its lowest points stand in each of its sections of equal length.

    Attributes
    ----------
    wall : WallLine
    bases : (n,) metres, from the first to the last vertex; NaN where the terrain is not known
    """

    wall: WallLine
    bases: FloatArray


def known_walls(walls: Sequence[WallLine], points: WallPoints, ground: Heights) -> list[KnownWall]:
    """Every wall with the bases of its sections."""
    tree = cKDTree(points.xyz[:, :2]) if len(points) else None
    return [KnownWall(w, _bases(w, points, tree, ground)) for w in walls]


def _bases(wall: WallLine, points: WallPoints, tree: cKDTree | None, ground: Heights) -> FloatArray:
    count = max(round(wall.line.length / SECTION_M), 1)
    where = (np.arange(count) + 0.5) / count
    middle = shapely.get_coordinates(shapely.line_interpolate_point(wall.line, where, normalized=True))
    before = middle + _BEFORE_M * np.asarray(wall.normal)
    low = np.full(count, np.nan)
    if tree is not None:
        for k, near in enumerate(tree.query_ball_point(middle, _NEAR_M, return_sorted=True)):
            z = points.xyz[near, 2][points.normal[near] @ np.asarray(wall.normal, np.float32) > _SAME_SIDE]
            if len(z) >= _LEAST_POINTS:
                low[k] = np.quantile(z, _LOWEST)
    known = np.flatnonzero(np.isfinite(low))
    if not len(known):
        return np.full(count, wall.base_m)
    nearest = known[np.argmin(np.abs(np.arange(count)[:, None] - known[None]), axis=1)]
    terrain = ground(before[:, 0], before[:, 1])
    return np.asarray(low[nearest] - np.where(np.isfinite(terrain), terrain, wall.ground_z))
