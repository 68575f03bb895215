"""Where the wall below an edge of the outline stands: at the outline, or where façade points say, or unknown.

An outline follows walls only where façades were seen when it was found; elsewhere it is the rim of the roof, and a reach
that counted from it would be none. Façade points that were too few for a line of their own then still tell how far inside the wall is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.core.building import EdgeOverhang, OutlineEdge
from cityflow.core.reconstruction import Evidence
from cityflow.core.wall_points import WallPoints
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.wall_edges import WallEdge, wall_edges

ROOF = "roof"
"""`OutlineEdge.source` of a part of an outline that is the roof's edge."""
INSIDE_M, OUTSIDE_M = 2.0, 0.6
"""Façade points are looked for so far on both sides of an edge; what stands outside is soon another building's."""
TURN_DEG = 25.0
BELOW_ROOF_M = 0.3
"""Higher points are dragged towards the rim by the matching of the roof."""
STEP_M, HALF_M, TRIM_M = 0.05, 0.12, 0.15
CELL_M = 0.5
"""Points are counted by cells of the façade: a window frame of a thousand points is no better than the wall around it."""
LEAST_POINTS, LEAST_SHARE, LEAST_RISE_M = 30, 0.4, 1.0
LEAST_ECHOES = 8
APART_M, MOST_RIVAL = 0.3, 0.75
"""Two places so far apart, the weaker with more than this share of the other's cells: the points do not tell which is the wall."""
ALIKE_POINTS = 10.0
"""So many neighbouring points err together."""
ON_OUTLINE_M = 0.05


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
    unsaid_sigma_m: float | None = None,
    scanned: bool = False,
) -> StandingWall:
    """The wall of one edge, by what is known of the outline there and by the points on its façade.

    Parameters
    ----------
    roof_m : world height of the roof where it is lowest along the edge
    unsaid_sigma_m : standard deviation of the outline where nothing says how it is known
    scanned : points around the unit are a laser's; those that images give between roof and ground are smeared along the rim
    """
    said = _part_of_outline(edge, evidence.edges)
    of_roof = said is not None and said.source == ROOF
    unsaid = p.outline_sigma_m if unsaid_sigma_m is None else unsaid_sigma_m
    outline_sigma = said.sigma_m if said is not None and np.isfinite(said.sigma_m) else unsaid
    facade = None if edge.party else _facade(edge, evidence, roof_m, p, scanned)
    if facade is None:
        return UNKNOWN if of_roof else StandingWall(0.0, outline_sigma)
    place, sigma = facade
    limit = (
        p.roof_edge_off_m
        if of_roof
        else p.wall_edge_off_m
        if said is not None and said.source == "wall"
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


def _part_of_outline(edge: WallEdge, known: Sequence[OutlineEdge]) -> OutlineEdge | None:
    """What is said of the part of the outline that the edge lies on."""
    middle = shapely.Point((edge.xy[0] + edge.xy[-1]) / 2)
    near = [(float(shapely.distance(e.line, middle)), k) for k, e in enumerate(known)]
    return known[min(near)[1]] if near and min(near)[0] <= ON_OUTLINE_M else None


def facade_place(edge: WallEdge, walls: WallPoints, roof_m: float, least_sigma_m: float) -> tuple[float, float] | None:
    """How far outside an edge its façade stands by the points on it, and with what standard deviation; None where they do not tell.

    The line parallel to the edge beside which most of the façade has points; these may be anywhere within `INSIDE_M`.
    """
    if len(walls) == 0:
        return None
    offset = walls.xyz[:, :2] - edge.start
    s, t, z = offset @ edge.along, offset @ edge.outward, walls.xyz[:, 2]
    own = (s > 0) & (s < edge.length) & (t > -INSIDE_M) & (t < OUTSIDE_M)
    own &= walls.normal.astype(np.float64) @ edge.outward > np.cos(np.radians(TURN_DEG))
    if np.isfinite(roof_m):
        own &= z < roof_m - BELOW_ROOF_M
    if np.count_nonzero(own) < LEAST_POINTS:
        return None
    return _line_of(np.stack([s[own], t[own], z[own]]), edge.length, least_sigma_m, (LEAST_POINTS, ALIKE_POINTS))


def laser_place(edge: WallEdge, xyz: FloatArray, roof_m: float, least_sigma_m: float) -> tuple[float, float] | None:
    """The same by echoes, (N, 3) world, that no image has given a direction: those well below the roof, along one upright line; each errs by itself."""
    offset = xyz[:, :2] - edge.start
    s, t, z = offset @ edge.along, offset @ edge.outward, xyz[:, 2]
    own = (s > 0) & (s < edge.length) & (t > -INSIDE_M) & (t < OUTSIDE_M) & (z < roof_m - BELOW_ROOF_M)
    if np.count_nonzero(own) < LEAST_ECHOES:
        return None
    return _line_of(np.stack([s[own], t[own], z[own]]), edge.length, least_sigma_m, (LEAST_ECHOES, 1.0))


def _line_of(
    stz: FloatArray, length: float, least_sigma_m: float, weight: tuple[int, float]
) -> tuple[float, float] | None:
    """Along, across and height of points (3, n); how many there have to be, and how many err together."""
    (s, t, z), (least, alike) = stz, weight
    column, row = np.floor(s / CELL_M).astype(np.int64), np.floor((z - z.min()) / CELL_M).astype(np.int64)
    cell = column * (int(row.max()) + 1) + row
    places = np.arange(-INSIDE_M, OUTSIDE_M + STEP_M / 2, STEP_M)
    support = np.array([len(np.unique(cell[np.abs(t - place) < HALF_M])) for place in places])
    best = int(np.argmax(support))
    place = float(np.median(t[np.abs(t - places[best]) < HALF_M]))
    on = np.abs(t - place) < TRIM_M
    columns = max(1, int(length / CELL_M))
    rise = len(np.unique(row[on])) * CELL_M
    seen = len(np.unique(np.minimum(column[on], columns - 1))) / columns
    rival = int(support[np.abs(places - place) > APART_M].max(initial=0))
    count = int(np.count_nonzero(on))
    if count < least or seen < LEAST_SHARE or rise < LEAST_RISE_M or rival > MOST_RIVAL * support[best]:
        return None
    place = float(np.median(t[on]))
    spread = 1.4826 * float(np.median(np.abs(t[on] - place)))
    return place, float(np.hypot(1.25 * spread / np.sqrt(count / alike), least_sigma_m))


def line_of_wall(edge: WallEdge, wall: StandingWall) -> LineString:
    """The line that the reach of an edge counts from."""
    return LineString(edge.xy + wall.origin_m * edge.outward)


def at_outline(
    overhangs: Sequence[EdgeOverhang], evidence: Evidence, p: OverhangParameters
) -> tuple[EdgeOverhang, ...]:
    """Overhangs as they stand out beyond the outline: those that count from a wall apart from it reach less far, or not at all."""
    edges = wall_edges(evidence.outline, evidence.party)
    border = evidence.outline.boundary
    return tuple(
        o if shapely.covers(shapely.buffer(border, ON_OUTLINE_M), o.line) else _beyond_outline(o, edges, p)
        for o in overhangs
    )


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
