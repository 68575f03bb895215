"""Position of the wall below an edge of the outline: at the outline, at façade points, or unknown.

An outline follows walls only where façades were seen when it was found; elsewhere it is the rim of the roof, and a reach
that counted from it would be none. Façade points that were too few for a line of their own then still tell how far inside the wall is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.building import EdgeOverhang
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.facade_line import facade_place, laser_place
from cityflow.geometry.straight_edges import ON_OUTLINE_M, WallEdge, known_part, wall_edges
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters

ROOF = "roof"
"""`OutlineEdge.source` of a part of an outline that is the roof's edge."""


@dataclass(frozen=True, slots=True)
class StandingWall:
    """The wall below an edge.

    Attributes
    ----------
    place_m : metres outside the edge, as far as that is known
    sigma_m : its standard deviation; NaN where nothing tells
    apart : it stands so far from the edge that the edge is not the wall
    """

    place_m: float
    sigma_m: float
    apart: bool = False

    @property
    def known(self) -> bool:
        return bool(np.isfinite(self.sigma_m))

    @property
    def origin_m(self) -> float:
        """What the edge's reach counts from, metres outside the edge."""
        return self.place_m if self.apart else 0.0


UNKNOWN = StandingWall(0.0, float("nan"))


def standing_wall(
    edge: WallEdge,
    evidence: Evidence,
    roof_m: float,
    p: OverhangParameters,
    default_sigma_m: float | None = None,
    scanned: bool = False,
) -> StandingWall:
    """The wall of one edge, by what is known of the outline there and by the points on its façade.

    Parameters
    ----------
    roof_m : world height of the roof where it is lowest along the edge
    default_sigma_m : standard deviation of the outline where nothing says how it is known
    scanned : points around the unit are a laser's; those that images give between roof and ground are smeared along the rim
    """
    part = known_part(edge, evidence.edges)
    of_roof = part is not None and part.source == ROOF
    default_sigma = p.general_sigma_m if default_sigma_m is None else default_sigma_m
    outline_sigma = part.sigma_m if part is not None and np.isfinite(part.sigma_m) else default_sigma
    facade = None if edge.party else _facade(edge, evidence, roof_m, p, scanned)
    if facade is None:
        return UNKNOWN if of_roof else StandingWall(0.0, outline_sigma)
    place, sigma = facade
    limit = (
        p.roof_edge_off_m
        if of_roof
        else p.wall_edge_off_m
        if part is not None and part.source == "wall"
        else p.given_edge_off_m
    )
    if abs(place) > max(limit, p.significance * float(np.hypot(sigma, outline_sigma))):
        return StandingWall(place, sigma, True)
    return _joined(place, sigma, outline_sigma)


def _facade(
    edge: WallEdge, evidence: Evidence, roof_m: float, p: OverhangParameters, scanned: bool
) -> tuple[float, float] | None:
    """By façade points of images where there are any, else by a laser's echoes."""
    if scanned and not len(evidence.walls):
        return laser_place(edge, evidence.around.xyz, roof_m, p.wall_sigma_m)
    return facade_place(edge, evidence.walls, roof_m, p.wall_sigma_m)


def _joined(place: float, sigma: float, outline_sigma: float) -> StandingWall:
    """Façade and outline by their precision; where they do not agree, no more exact than that."""
    of_facade, of_outline = sigma**-2, max(outline_sigma, 1e-3) ** -2
    both = of_facade + of_outline
    middle = place * of_facade / both
    spread = of_facade * (place - middle) ** 2 + of_outline * middle**2
    return StandingWall(middle, float(np.sqrt((1.0 + spread) / both)))


def line_of_wall(edge: WallEdge, wall: StandingWall) -> LineString:
    """The line that the reach of an edge counts from."""
    return LineString(edge.xy + wall.origin_m * edge.outward)


def at_outline(
    overhangs: Sequence[EdgeOverhang], evidence: Evidence, p: OverhangParameters
) -> tuple[EdgeOverhang, ...]:
    """Overhangs as they stand out beyond the outline: those that count from a wall apart from it reach less far, or not at all."""
    edges = wall_edges(evidence.outline, evidence.party)
    at_border = shapely.covers(shapely.buffer(evidence.outline.boundary, ON_OUTLINE_M), [o.line for o in overhangs])
    return tuple(o if at else _beyond_outline(o, edges, p) for o, at in zip(overhangs, at_border, strict=True))


def _beyond_outline(overhang: EdgeOverhang, edges: Sequence[WallEdge], p: OverhangParameters) -> EdgeOverhang:
    """Counted from the edge that its line is parallel to."""
    ends = shapely.get_coordinates(overhang.line)[[0, -1]]
    fit = []
    for number, edge in enumerate(edges):
        moved = ends - edge.xy[[0, -1]]
        off = moved @ edge.outward
        if np.hypot(*(moved - off.mean() * edge.outward).T).max() < ON_OUTLINE_M:
            fit.append((abs(float(off.mean())), number, float(off.mean())))
    if not fit:
        return overhang
    _, number, off = min(fit)
    reach = overhang.reach_m + off
    least = max(p.least_reach_m, p.significance * overhang.sigma_m if np.isfinite(overhang.sigma_m) else 0.0)
    return EdgeOverhang(edges[number].line, reach if reach >= least else 0.0, overhang.sigma_m, overhang.seen)
