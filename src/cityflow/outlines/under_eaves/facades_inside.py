"""Façades under the eaves of a roof whose rim is the outline, from façade points and the extent of the roof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Outline
from cityflow.core.facade_points import WallPoints
from cityflow.geometry.facade_line import (
    BELOW_ROOF_M,
    INSIDE_M,
    LEAST_RISE_M,
    OUTSIDE_M,
    TURN_DEG,
    facade_place,
    laser_place,
)
from cityflow.geometry.straight_edges import WallEdge, known_part
from cityflow.outlines.under_eaves.walls_in import LEAST_ROOFED, ROOF, Facade

LARGEST_M = 60.0
"""Walls of wider outlines stay: a tile's task sees all that is near to its outlines and to those that touch them, and no farther."""
NEAR_M = 3.0
"""What stands this near to an outline may be its façade; set by hand."""
COLUMN_M = 1.0
"""Roofs are looked at by so much of an edge at a time."""
RIM_M, BEHIND_M, PAST_FACADE_M = 0.4, 0.6, 0.1
"""The roof's rim is seen within so much of the edge; the roof over the wall so far behind a façade; its eaves from so far before it on; set by hand."""
LOWEST_SHARE = 0.1
"""Quantile of the heights along an edge that counts as their lowest; set by hand."""
DROP_M, RISE_M = 1.25, 0.5
"""Eaves lie no lower than this below the roof 0.7 m farther in, which is a slope of 60°, and no higher: an annex and a tree are no eaves; set by hand."""
LEAST_COLUMNS = 0.4
"""Of the places along an edge, this share has a height; set by hand."""
WALL_SIGMA_M = 0.03
"""Standard deviation of a façade however many points tell it, as `reconstruct.overhangs.wall_sigma_m`."""
SMEARED_M, LEANING_M = 0.6, 0.15
"""So far around a line points are looked at; the upper and the lower half of a wall stand no farther apart; set by hand."""


@dataclass(frozen=True, slots=True)
class SeenHouses:
    """What is seen of houses from above and from the side.

    Attributes
    ----------
    tops : (N, 3) world, sorted by x: points of the cloud of the surface source, or cells of its surface, with roofs among them
    walls : points on façades; None where `tops` are a laser's points, whose echoes on façades are among them
    """

    tops: FloatArray
    walls: WallPoints | None

    @staticmethod
    def of(tops: FloatArray, walls: WallPoints | None) -> SeenHouses:
        if walls is not None:
            walls = walls.take(np.argsort(walls.xyz[:, 0], kind="stable"))
        return SeenHouses(tops[np.argsort(tops[:, 0], kind="stable")], walls)

    def beside(self, edge: WallEdge) -> tuple[FloatArray, WallPoints | None]:
        """What lies within reach of an edge."""
        low, high = edge.xy.min(axis=0) - INSIDE_M - BEHIND_M, edge.xy.max(axis=0) + INSIDE_M + BEHIND_M
        near = self.tops[_part(self.tops[:, 0], low[0], high[0])]
        near = near[(near[:, 1] >= low[1]) & (near[:, 1] <= high[1])]
        if self.walls is None:
            return near, None
        walls = self.walls.take(np.arange(len(self.walls))[_part(self.walls.xyz[:, 0], low[0], high[0])])
        return near, walls.take((walls.xyz[:, 1] >= low[1]) & (walls.xyz[:, 1] <= high[1]))


def _part(x: FloatArray, low: float, high: float) -> slice:
    return slice(int(np.searchsorted(x, low)), int(np.searchsorted(x, high, side="right")))


def facade_beside(edge: WallEdge, seen: SeenHouses, least_rise_m: float = LEAST_RISE_M) -> tuple[float, float] | None:
    """How far outside an edge of a roof its façade stands, and with what standard deviation; None where nothing tells, or no roof ends there."""
    tops, walls = seen.beside(edge)
    roof = _lowest_rim(edge, tops)
    if roof is None:
        return None
    if walls is None:
        return laser_place(edge, tops, roof, WALL_SIGMA_M, least_rise_m)
    found = facade_place(edge, walls, roof, WALL_SIGMA_M)
    return None if found is None else _upright(edge, walls, roof, found)


def _upright(
    edge: WallEdge, walls: WallPoints, roof_m: float, found: tuple[float, float]
) -> tuple[float, float] | None:
    """A line of points of images, if what is around it is a wall: matching smears narrow gaps and façades seen aslant over half a metre, leaning.

    Half of the scatter across the line may be an error of the whole façade.
    """
    place, sigma = found
    offset = walls.xyz[:, :2] - edge.start
    s, t, z = offset @ edge.along, offset @ edge.outward - place, walls.xyz[:, 2]
    own = (s > 0) & (s < edge.length) & (np.abs(t) < SMEARED_M) & (z < roof_m - BELOW_ROOF_M)
    own &= walls.normal.astype(np.float64) @ edge.outward > np.cos(np.radians(TURN_DEG))
    upper = z[own] > np.median(z[own])
    if abs(float(np.median(t[own][upper]) - np.median(t[own][~upper]))) > LEANING_M:
        return None
    scatter = 1.4826 * float(np.median(np.abs(t[own] - np.median(t[own]))))
    return place, float(np.hypot(sigma, scatter / 2))


def facade_inside(outline: Outline, edge: WallEdge, seen: SeenHouses, outline_sigma_m: float) -> Facade | None:
    """The façade under the eaves that end with an edge.

    Where it is said that façades gave the edge it is the wall. Where it is said that the roof's edge did, in cells of a surface, the wall is there in any
    case; eaves need not be looked for in the very same cells, but points of a laser may tell that there are none.

    Parameters
    ----------
    outline_sigma_m : standard deviation of an edge of which nothing is said
    """
    part = known_part(edge, outline.edges)
    if part is not None and part.source == "wall":
        return None
    found = facade_beside(edge, seen)
    if found is None or found[0] >= -PAST_FACADE_M:
        return None
    of_roof = part is not None and part.source == ROOF
    roofed = 1.0 if of_roof and seen.walls is not None else _roofed(edge, found[0], seen.beside(edge)[0])
    if roofed < LEAST_ROOFED and not of_roof:
        return None
    sigma = part.sigma_m if part is not None and np.isfinite(part.sigma_m) else outline_sigma_m
    return Facade(*found, sigma, roofed)


def _lowest_rim(edge: WallEdge, tops: FloatArray) -> float | None:
    """World height of the roof where it is lowest along its rim; None where too little is seen of it."""
    height = _by_columns(edge, tops, (-RIM_M, PAST_FACADE_M / 2))
    known = np.isfinite(height)
    if known.mean() < LEAST_COLUMNS:
        return None
    return float(np.quantile(height[known], LOWEST_SHARE))


def _roofed(edge: WallEdge, place: float, tops: FloatArray) -> float:
    """Share of an edge out to which the roof over a façade goes on; 0 where too little is seen of it."""
    eaves = _by_columns(edge, tops, (place + PAST_FACADE_M, 0.0))
    behind = _by_columns(edge, tops, (place - BEHIND_M, place))
    both: BoolArray = np.isfinite(eaves) & np.isfinite(behind)
    if both.mean() < LEAST_COLUMNS:
        return 0.0
    rise = (eaves - behind)[both]
    return float(np.mean((rise > -DROP_M) & (rise < RISE_M)))


def _by_columns(edge: WallEdge, tops: FloatArray, across: tuple[float, float]) -> FloatArray:
    """(n,) greatest height in each metre of an edge, between two distances outside it; NaN where nothing is."""
    offset = tops[:, :2] - edge.start
    s, t = offset @ edge.along, offset @ edge.outward
    count = max(1, round(edge.length / COLUMN_M))
    inside = (s >= 0) & (s < edge.length) & (t >= across[0]) & (t < min(across[1], OUTSIDE_M))
    column = np.minimum((s[inside] * count / edge.length).astype(np.int64), count - 1)
    height = np.full(count, -np.inf)
    np.maximum.at(height, column, tops[inside, 2])
    return np.where(np.isfinite(height), height, np.nan)
