"""Walls under the eaves of a roof: images see little of their height, but nothing else stands up there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray
from cityflow.core.facade_points import WallPoints
from cityflow.geometry.facade_line import BELOW_ROOF_M
from cityflow.outlines.from_walls.wall_line import Heights, WallLine

EAVES_M = 0.4
"""Eaves reach at least so far out before the points under them; set by hand on synthetic towns, as are those below."""
BESIDE_M = 1.0
"""What is seen of a wall so near to another of its side tells of the same wall."""
BESIDE_SHARE = 0.5
"""Of its length, from which on it does."""
ALIKE_COS = np.cos(np.radians(30.0))
"""Of one side are walls that turn less."""
STEP_M = 0.25
"""A wall is compared every so many metres."""


def under_eaves(walls: WallPoints, roofs: Heights) -> BoolArray:
    """(N,) points with a roof over them that goes on before them.

    Points nearer below the roof may be dragged towards its rim by matching, and a wall without eaves has nothing before it.

    Parameters
    ----------
    roofs : world heights of roofs, NaN where there is none
    """
    here, before = walls.xyz[:, :2], walls.xyz[:, :2] + EAVES_M * walls.normal.astype(np.float64)
    with np.errstate(invalid="ignore"):
        over = [roofs(xy[:, 0], xy[:, 1]) - walls.xyz[:, 2] > BELOW_ROOF_M for xy in (here, before)]
    return np.asarray(over[0] & over[1])


def are_beside(lines: Sequence[WallLine], others: Sequence[WallLine]) -> BoolArray:
    """(N,) whether other walls of the same side run near a line, along most of it."""
    tree = shapely.STRtree([w.line for w in others])
    found = np.zeros(len(lines), bool)
    for k, wall in enumerate(lines):
        near = [others[n] for n in np.sort(tree.query(wall.line, predicate="dwithin", distance=BESIDE_M)).tolist()]
        alike = [w.line for w in near if wall.normal @ w.normal > ALIKE_COS]
        count = max(round(wall.line.length / STEP_M), 1)
        at = shapely.line_interpolate_point(wall.line, (np.arange(count) + 0.5) / count, normalized=True)
        beside = [shapely.dwithin(at, line, BESIDE_M) for line in alike]
        found[k] = bool(beside) and np.any(beside, axis=0).mean() >= BESIDE_SHARE
    return found
