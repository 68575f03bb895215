"""Moves walls in where an outline is the rim of the roof and façades are seen inside.

Outlines come noded; only edges that no neighbour touches move, so what neighbours share stays. Their corners slide along shared walls, and leave
a vertex in the neighbour's outline there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from pydantic import Field
from shapely import LineString, Polygon

from cityflow.core.building import Outline, OutlineEdge
from cityflow.core.parameters import Parameters
from cityflow.geometry.straight_edges import WallEdge, wall_edges, wall_rings
from cityflow.outlines.given.edited import DRAWN, LOCKED
from cityflow.outlines.under_eaves.moved_edges import TURN_DEG, noded_again, polygon_of, ring_moved

ROOF = "roof"
"""`OutlineEdge.source` of a part of an outline that is the roof's edge."""
MOVED = "walls moved in from the roof's rim: {} of {} edges"
LEAST_LEFT = 0.5
"""Share of an outline's area that its walls keep; set by hand, as are those below."""
LEAST_ROOFED = 0.5
"""An edge is the rim of the roof where the roof reaches out to it along this share of its length."""
TIE_M, ON_LINE_M = 1e-3, 0.01
"""How near vertices of neighbours lie on an edge, and edges on one line."""


class WallsInParameters(Parameters):
    """When a façade inside an outline is the wall, and the outline the rim of the roof."""

    wanted: bool = Field(True, description="walls move in where façades are known inside the rim of a roof")
    significance: float = Field(
        2.0,
        ge=0,
        le=10,
        description="a wall moves in if its façade is inside by more than so many standard deviations of façade and outline together",
    )
    least_m: float = Field(
        0.15, ge=0.02, le=2, description="a wall moves in if its façade is inside by at least this distance, m"
    )


@dataclass(frozen=True, slots=True)
class Facade:
    """A façade beside an edge of an outline.

    Attributes
    ----------
    place_m : metres outside the edge, so that a wall under eaves has a negative one
    sigma_m : its standard deviation
    outline_sigma_m : that of the edge itself, which is the roof's rim
    roofed : share of the edge up to which the roof is known to reach
    """

    place_m: float
    sigma_m: float
    outline_sigma_m: float
    roofed: float = 1.0


FindFacade = Callable[[Outline, WallEdge], Facade | None]
"""The façade under the roof whose rim an edge is; None where there is none, or the roof does not reach from it to the edge."""


def walls_moved_in(outlines: Sequence[Outline], facade: FindFacade, parameters: WallsInParameters) -> list[Outline]:
    """Outlines by their walls as far as façades tell; what an outline was before is its `roof` where it had none yet, and the roof reaches out to it.

    Parameters
    ----------
    outlines : noded, with the edges that they share in `party`; those that a person has drawn stay
    facade : asked for each straight edge that no neighbour touches
    """
    stay = {k for k, o in enumerate(outlines) if not parameters.wanted or _drawn(o)}
    moved = [o if k in stay else _moved(o, facade, parameters) for k, o in enumerate(outlines)]
    while True:
        noded = noded_again([o.polygon for o in outlines], [o.polygon for o in moved])
        broken = [k for k, p in enumerate(noded) if p is None]
        if not broken:
            return [
                o if p is o.polygon else replace(o, polygon=p)
                for o, p in zip(moved, noded, strict=True)
                if p is not None
            ]
        moved = [outlines[k] if k in broken else o for k, o in enumerate(moved)]


def _drawn(outline: Outline) -> bool:
    return DRAWN in outline.remark or LOCKED in outline.remark


def _moved(outline: Outline, facade: FindFacade, p: WallsInParameters) -> Outline:
    """The very same object where nothing moves."""
    rings = wall_rings(outline.polygon, outline.party)
    found = {
        k: seen for k, edge in _free_edges(rings) if (seen := facade(outline, edge)) is not None and _counts(seen, p)
    }
    polygon, kept = outline.polygon, dict[int, Facade]()
    for number, seen in sorted(found.items(), key=lambda item: (item[1].place_m / item[1].sigma_m, item[0])):
        tried = _with_moves(rings, {**kept, number: seen})
        if tried is not None and tried.area >= LEAST_LEFT * outline.polygon.area:
            polygon, kept = tried, {**kept, number: seen}
    if not kept:
        return outline
    edges = [edge for ring in rings for edge in ring]
    remark = MOVED.format(len(kept), len(edges))
    rims = tuple(
        OutlineEdge(edges[k].line, ROOF, seen.outline_sigma_m, seen.roofed)
        for k, seen in sorted(kept.items())
        if seen.roofed >= LEAST_ROOFED
    )
    return replace(
        outline, polygon=polygon, roof=outline.roof or (outline.polygon if rims else None), remark="; ".join(filter(None, [outline.remark, remark])),
        edges=_edges(outline, polygon, {k: (edges[k], seen) for k, seen in kept.items()}),
        rims=(*outline.rims, *rims),
    )  # fmt: skip


def _counts(seen: Facade, p: WallsInParameters) -> bool:
    """Whether a façade stands so far inside that its edge moves to it."""
    return -seen.place_m > max(p.least_m, p.significance * float(np.hypot(seen.sigma_m, seen.outline_sigma_m)))


def _free_edges(rings: Sequence[Sequence[WallEdge]]) -> list[tuple[int, WallEdge]]:
    """Edges that no neighbour touches, and that do not go straight on as one that a neighbour does: a wall has no step there."""
    free, first = [], 0
    for ring in rings:
        for k, edge in enumerate(ring):
            beside = ring[k - 1], ring[(k + 1) % len(ring)]
            if not edge.party and not any(
                b.party and b.along @ edge.along > np.cos(np.radians(TURN_DEG)) for b in beside
            ):
                free.append((first + k, edge))
        first += len(ring)
    return free


def _with_moves(rings: Sequence[Sequence[WallEdge]], moves: Mapping[int, Facade]) -> Polygon | None:
    made, first = [], 0
    for edges in rings:
        inwards = [-moves[first + k].place_m if first + k in moves else 0.0 for k in range(len(edges))]
        moved = ring_moved(edges, inwards)
        if moved is None:
            return None
        made.append(moved)
        first += len(edges)
    return polygon_of(made)


def _edges(outline: Outline, polygon: Polygon, moved: dict[int, tuple[WallEdge, Facade]]) -> tuple[OutlineEdge, ...]:
    """How each edge is known now: those moved by their façades, the others as before, as far as they are still there."""
    border = shapely.buffer(polygon.boundary, TIE_M)
    known = [replace(e, line=part) for e in outline.edges for part in _lines(shapely.intersection(e.line, border))]
    for new in wall_edges(polygon, ()):
        middle = (new.xy[0] + new.xy[-1]) / 2
        for edge, seen in moved.values():
            off = (middle - edge.start) @ edge.outward - seen.place_m
            if abs(off) < ON_LINE_M and new.along @ edge.along > np.cos(np.radians(1.0)):
                known.append(OutlineEdge(new.line, "wall", seen.sigma_m, 1.0))
                break
    return tuple(known)


def _lines(shape: shapely.Geometry) -> list[LineString]:
    return [p for p in shapely.get_parts(shape) if isinstance(p, LineString) and p.length > TIE_M]
