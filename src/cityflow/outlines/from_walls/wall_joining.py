"""Which segments are walls: long ones for themselves, short ones and the reserve where they join others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.sparse.csgraph import connected_components

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.outlines.from_walls.wall_line import WallLine

ALONE = 1.5
"""A wall that meets no other must be so many times as long; set by hand."""
ALONE_ABOVE, FLOATING_M = 2.0, 2.5
"""And so many times where it begins so high above the ground: crowns of trees do, and so do walls above a lower roof; set by hand."""
TOGETHER = 2.0
"""Short walls that meet one another stay if their lengths sum up to so many least lengths: a bay whose house is hidden; set by hand."""
BODY = 0.5
"""An end that meets another wall somewhere along its length must come so much nearer than where two ends meet; set by hand."""
ALIKE_HIGH = 0.5
"""Walls are about as high if so much of the higher one's height is common to both; set by hand on synthetic towns."""
ACROSS_COS = 0.7
"""Walls that turn by more than 45 degrees stand across each other; set by hand."""


def joined(
    lines: Sequence[WallLine], sure: Sequence[bool], least_m: FloatArray, reach_m: float, sigma_m: float
) -> BoolArray:
    """(N,) which lines are kept (Nex et al. 2013 §2.3: short and disconnected edges go).

    Sure lines of `least_m` or more stay, if they meet another or are half as long again. Shorter ones stay where both ends meet other
    walls, or one end meets a wall about as high: steps between two houses, sides of bays. What is not sure stays only where both ends
    meet walls that stay.

    Parameters
    ----------
    lines, sure : and whether each keeps all rules
    least_m : (N,) metres
    reach_m : ends so near to another wall meet it, metres
    sigma_m : short walls are no less precise: leaves make lines, but poor ones
    """
    if not lines:
        return np.zeros(0, bool)
    length, certain = np.array([w.line.length for w in lines]), np.asarray(sure, bool)
    meets = _meets(lines, reach_m)
    met = np.asarray(meets.any(axis=0))
    alone = ~(met | met.T).any(axis=1)
    floating = np.array([w.base_m for w in lines]) > FLOATING_M
    long = certain & (length >= least_m * np.where(alone, np.where(floating, ALONE_ABOVE, ALONE), 1.0))
    across = np.abs(_normals(lines) @ _normals(lines).T) < ACROSS_COS
    as_high = _alike_high(lines) >= ALIKE_HIGH
    kept = long | (np.array([w.sigma_m for w in lines]) <= sigma_m)
    while True:
        # meets[e, i, j]: end e of line i meets line j
        at = meets & kept[None, None, :]
        both = at.any(axis=2).all(axis=0) & (at & across).any(axis=(0, 2))
        one = (at & across & as_high).any(axis=(0, 2))
        held = kept & (long | both | (certain & one))
        if (held == kept).all():
            break
        kept = held
    return _rooted(kept, long, certain * length, meets, least_m)


def _rooted(kept: BoolArray, long: BoolArray, length: FloatArray, meets: BoolArray, least_m: FloatArray) -> BoolArray:
    """Of the lines kept those that hang together with a long one, or with others that are long enough in sum."""
    touching = meets.any(axis=0)
    touching = (touching | touching.T) & kept[None, :] & kept[:, None]
    _, group = connected_components(touching, directed=False)
    whole = np.bincount(group, length * kept / least_m) >= TOGETHER
    rooted = np.bincount(group, long & kept) > 0
    return np.asarray(kept & (whole | rooted)[group])


def _meets(lines: Sequence[WallLine], reach: float) -> BoolArray:
    """(2, N, N) whether an end of a line meets another line: the last vertex the first of the other, or its length somewhere.

    Who walks around a building with the outside on the right comes from the end of a wall to the beginning of the next. Two ends that point
    at each other the other way round border nothing.
    """
    shapes = np.array([w.line for w in lines])
    first = np.array([w.line.coords[0][:2] for w in lines])
    last = np.array([w.line.coords[-1][:2] for w in lines])
    found = np.zeros((2, len(lines), len(lines)), bool)
    for e, (own, others) in enumerate(((first, last), (last, first))):
        near_end = np.hypot(*(own[:, None] - others[None]).transpose(2, 0, 1)) <= reach
        wrong_end = np.hypot(*(own[:, None] - own[None]).transpose(2, 0, 1)) <= reach
        body = shapely.distance(shapely.points(own)[:, None], shapes[None]) <= BODY * reach
        found[e] = near_end | (body & ~wrong_end)
        np.fill_diagonal(found[e], False)
    return found


def _normals(lines: Sequence[WallLine]) -> FloatArray:
    return np.array([w.normal for w in lines])


def _alike_high(lines: Sequence[WallLine]) -> FloatArray:
    """(N, N) common part of the heights of two walls, as a share of what both cover."""
    low, high = np.array([w.z_low for w in lines]), np.array([w.z_high for w in lines])
    common = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    whole = np.maximum(high[:, None], high[None]) - np.minimum(low[:, None], low[None])
    return np.asarray(np.maximum(common, 0.0) / np.maximum(whole, 1e-9))
