"""Which rims are overhangs, and how far they reach beyond the walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.building import EdgeOverhang
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.standing_wall import StandingWall, line_of_wall

SEEN_WELL = 0.5
"""Of its places, this share was seen: the majority."""
NAN = float("nan")


@dataclass(frozen=True, slots=True)
class RimOfEdge:
    """Where the rim of one edge was seen.

    Attributes
    ----------
    edge : the edge
    reach_m : metres beyond the edge, the surface's own widening taken off; NaN where it was not seen
    sigma_m : standard deviation of that, without that of the wall
    chance_m : the part of it that other edges of the building do not have in common with this one
    seen : share of the profiles that show a rim
    eave : the roof is level along it
    nearest_m : the least of what heights and colours say, each alone
    confirmed : more than heights tell of it
    """

    edge: WallEdge
    reach_m: float
    sigma_m: float
    chance_m: float
    seen: float
    eave: bool
    nearest_m: float
    confirmed: bool


def unseen(edge: WallEdge, *, eave: bool = False) -> RimOfEdge:
    return RimOfEdge(edge, NAN, NAN, NAN, 0.0, eave, NAN, False)


def decided(
    rims: Sequence[RimOfEdge], walls: Sequence[StandingWall], p: OverhangParameters
) -> tuple[EdgeOverhang, ...]:
    """The overhang of every edge.

    Each has its own value, drawn to those of edges like it as far as it is uncertain; 0 where that may be chance. Nothing is
    stated of an edge whose wall or rim was not seen.
    """
    return tuple(_decided(k, rims, walls, p) for k in range(len(rims)))


def _decided(
    number: int, rims: Sequence[RimOfEdge], walls: Sequence[StandingWall], p: OverhangParameters
) -> EdgeOverhang:
    rim, wall = rims[number], walls[number]
    if rim.edge.party or not np.isfinite(rim.reach_m) or rim.seen < p.least_seen:
        return EdgeOverhang(rim.edge.line, 0.0, seen=rim.seen)
    if not wall.known:
        return EdgeOverhang(rim.edge.line, 0.0)
    reach, sigma = _with_prior(number, rims, walls, p.eave_spread_m)
    total = float(np.hypot(sigma, wall.sigma_m))
    line = line_of_wall(rim.edge, wall)
    if reach < p.least_reach_m or _may_be_chance(rim, reach + wall.origin_m, sigma, wall, p):
        return EdgeOverhang(line, 0.0, total, rim.seen)
    return EdgeOverhang(line, min(reach, p.most_reach_m), total, rim.seen)


def _may_be_chance(rim: RimOfEdge, reach: float, sigma: float, wall: StandingWall, p: OverhangParameters) -> bool:
    """Whether a roof that ends with its wall may look like that; `reach` counts from the edge.

    Heights err in one direction along a whole edge where matching draws a bright roof out over shadow, colours where a shadow runs along the wall:
    a small reach counts only where both show it.
    """
    beyond, of_wall = reach - wall.place_m, p.significance * wall.sigma_m
    if not rim.confirmed:
        return beyond < max(float(np.hypot(p.alone_significance * sigma, of_wall)), p.least_reach_m)
    total = float(np.hypot(sigma, wall.sigma_m))
    nearest = rim.nearest_m - wall.place_m
    return beyond < max(p.significance * total, p.least_reach_m) or nearest < p.each_significance * total


def _with_prior(
    number: int, rims: Sequence[RimOfEdge], walls: Sequence[StandingWall], spread_m: float
) -> tuple[float, float]:
    """An edge's reach from its wall, and its standard deviation without the wall's."""
    rim = rims[number]
    reach = rim.reach_m - walls[number].origin_m
    others = [
        r.reach_m - w.origin_m
        for k, (r, w) in enumerate(zip(rims, walls, strict=True))
        if k != number and r.eave == rim.eave and w.known and np.isfinite(r.reach_m) and r.seen > SEEN_WELL
    ]
    if len(others) < 2:
        return reach, rim.sigma_m
    prior = float(np.median(others))
    own, alike = 1.0 / rim.chance_m**2, 1.0 / spread_m**2
    common = max(rim.sigma_m**2 - rim.chance_m**2, 0.0)
    return (own * reach + alike * prior) / (own + alike), float(np.sqrt(common + 1.0 / (own + alike)))
