"""Eaves inside a unit: a high roof that stands out beyond its wall over a lower roof of the same unit.

Points of roofs end at the rim, so a model has its step there. Roof faces that meet without a step are one part of the roof. Each part that ends high enough
over others is searched like a building of its own, whose other edges touch a neighbour. Where façade points show the wall under the step, and the surface
shows the rim beyond it, the step moves to the wall, and what stands out becomes surfaces beyond the walls, as other eaves are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import LineString, Polygon

from cityflow.core.arrays import IntArray
from cityflow.core.building import VERTEX_DECIMALS, Face, OutlineEdge, Polyhedron, Semantic
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.roof_distances import roof_hits
from cityflow.geometry.straight_edges import WallEdge, wall_edges
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.overhang_solid import WALL_LEFT_M, with_overhangs
from cityflow.reconstruction.overhangs.rim_search import find_overhangs
from cityflow.reconstruction.overhangs.standing_wall import ROOF
from cityflow.reconstruction.seen_steps.edge_lines import RoofStep, roof_steps
from cityflow.reconstruction.seen_steps.with_seen_steps import SeenStep, moved_to
from cityflow.reconstruction.solids.ring_tracing import group_rings, trace_rings

STEP_M, OUT_M = 0.1, 0.05
"""Places along a border are so far apart, and the lower roof is looked for so far beyond it; set by hand, as is the next."""
SHORTEST_M = 1.0
"""Shorter steps have no eave of their own; set by hand, as are those below."""
OVER_LOWER_M = 0.3
"""Façade points of a step stand so far over the lower roof."""
ON_EDGE_M, FACING = 0.02, 0.999
"""A wall of a step is on an edge of a part if it is so near to it, and leads the same way."""


class _Part(NamedTuple):
    """A part of the roof as a solid of its own; world frame.

    Attributes
    ----------
    closed : the pieces of its border that do not end over a lower roof
    low_m : height of the lowest of these lower roofs
    """

    solid: Polyhedron
    outline: Polygon
    closed: tuple[LineString, ...]
    low_m: float


def with_step_walls(best: Candidate, evidence: Evidence, parameters: OverhangParameters) -> Candidate:
    """The candidate with its steps at the walls under them, where the roof stands out beyond these; planes and outline stay."""
    if best.solid is None or not len(evidence.walls):
        return best
    steps, seen = roof_steps(best.solid, evidence.outline), list[SeenStep]()
    for part in _parts(best.solid, evidence.ground_height, parameters) if steps else ():
        own, around = _alone(part, best, evidence)
        edges = wall_edges(around.outline, around.party)
        for edge, found in zip(edges, find_overhangs(around, own, parameters), strict=True):
            off = float((shapely.get_coordinates(found.line)[0] - edge.start) @ edge.outward)
            step = _step_at(steps, edge) if found.reach_m > 0 and off < 0 else None
            if step is not None:
                seen.append(SeenStep(step[0], step[1] * off, found.reach_m / found.sigma_m))
    if not seen:
        return best
    solid, moved = moved_to(best.solid, evidence.outline, sorted(seen, key=lambda s: -s.sigmas))
    return replace(best, solid=solid, notes={**best.notes, "steps_at_walls": moved})


def _step_at(steps: Sequence[RoofStep], edge: WallEdge) -> tuple[RoofStep, int] | None:
    """The step whose walls are on an edge, and 1 where its normal leads outwards, else -1."""
    for step in steps:
        for e, turned in zip(step.edges, step.turned, strict=True):
            middle = e.start + e.length / 2 * e.along - edge.start
            on = abs(middle @ edge.outward) < ON_EDGE_M and 0 < middle @ edge.along < edge.length
            if on and e.outward @ edge.outward > FACING:
                return step, turned
    return None


def with_step_eaves(
    candidate: Candidate, solid: Polyhedron | None, evidence: Evidence, parameters: OverhangParameters
) -> Candidate:
    """The candidate with what of its higher roofs stands out over lower ones among its surfaces beyond walls, and among its overhangs.

    Parameters
    ----------
    solid : it ends at the walls everywhere
    """
    if solid is None or not len(evidence.walls):
        return candidate
    overhangs, surfaces = list(candidate.overhangs), [] if candidate.beyond is None else [candidate.beyond]
    for part in _parts(solid, evidence.ground_height, parameters):
        own, around = _alone(part, candidate, evidence)
        extended = with_overhangs(own, find_overhangs(around, own, parameters), around, parameters)
        if extended.beyond is not None:
            surfaces.append(extended.beyond)
            overhangs += [o for o in extended.overhangs if o.reach_m > 0]
    if len(overhangs) == len(candidate.overhangs):
        return candidate
    notes = {**candidate.notes, "step_eaves": len(overhangs) - len(candidate.overhangs)}
    return replace(candidate, overhangs=tuple(overhangs), beyond=_joined(surfaces), notes=notes)


def _alone(part: _Part, candidate: Candidate, evidence: Evidence) -> tuple[Candidate, Evidence]:
    """A part as a candidate, and what is known of it: its steps are edges of a roof until façade points show otherwise."""
    known = tuple(OutlineEdge(e.line, ROOF, float("nan")) for e in wall_edges(part.outline, part.closed))
    walls = evidence.walls.take(evidence.walls.xyz[:, 2] > part.low_m + OVER_LOWER_M)
    around = replace(evidence, outline=part.outline, party=part.closed, edges=known, rims=(), roof=None, walls=walls)
    return replace(candidate, solid=part.solid, overhangs=(), beyond=None), around


def _parts(solid: Polyhedron, floor: float, p: OverhangParameters) -> list[_Part]:
    """Those that end over others; none where the roof has no steps."""
    roofs = solid.of_semantic(Semantic.ROOF)
    label = _labels(roofs)
    found = []
    for k in range(int(label.max(initial=-1)) + 1):
        faces = [f for f, own in zip(roofs, label, strict=True) if own == k]
        part = _part(solid, faces, floor, p)
        if part is not None:
            found.append(part)
    return found


def _labels(faces: Sequence[Face]) -> IntArray:
    """(F,) part of each roof face: those with a common edge are of one part."""
    left = {edge: k for k, f in enumerate(faces) for ring in f.rings for edge in _edges(ring)}
    pairs = np.array([(k, left[v, u]) for (u, v), k in left.items() if (v, u) in left], np.int64).reshape(-1, 2)
    linked = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(faces), len(faces)))
    return np.asarray(connected_components(linked, directed=False)[1], np.int64)


def _part(solid: Polyhedron, faces: Sequence[Face], floor: float, p: OverhangParameters) -> _Part | None:
    """One part, its border with a vertex wherever a piece of it over a lower roof begins or ends; None where no piece is."""
    left = {edge for f in faces for ring in f.rings for edge in _edges(ring)}
    split, low_m = dict[tuple[int, int], list[tuple[float, float, bool]]](), np.inf
    for edge in sorted(left):
        if edge[::-1] not in left:
            split[edge], low = _pieces(solid, edge, p)
            low_m = min(low_m, low)
    vertices: list[tuple[float, float, float]] = [*map(tuple, solid.vertices.tolist())]
    made: dict[tuple[int, int], list[int]] = {}
    free: set[tuple[int, int]] = set()
    for (u, v), pieces in split.items():
        ends = [u]
        for _, share, _ in pieces[:-1]:
            at = solid.vertices[u] + share * (solid.vertices[v] - solid.vertices[u])
            vertices.append(tuple(np.round(at, VERTEX_DECIMALS).tolist()))
            ends.append(len(vertices) - 1)
        made[u, v] = ends
        free |= {e for e, piece in zip(pairwise((*ends, v)), pieces, strict=True) if piece[2]}
    if not free:
        return None
    roofs = [
        replace(f, rings=tuple(tuple(w for e in _edges(ring) for w in made.get(e, e[:1])) for ring in f.rings))
        for f in faces
    ]
    return _closed(vertices, roofs, (floor, low_m), free)


def _edges(ring: Sequence[int]) -> list[tuple[int, int]]:
    return list(pairwise((*ring, ring[0])))


def _closed(
    vertices: list[tuple[float, float, float]],
    roofs: list[Face],
    heights: tuple[float, float],
    free: set[tuple[int, int]],
) -> _Part | None:
    """The part with a ground face under it; None where its border is no simple ring."""
    left = {edge for f in roofs for ring in f.rings for edge in _edges(ring)}
    border = sorted((u, v) for u, v in left if (v, u) not in left)
    xy = [v[:2] for v in vertices]
    if len({u for u, _ in border}) < len(border):
        return None
    groups = group_rings(trace_rings(border, xy), xy)
    if len(groups) != 1:
        return None
    (rings,) = groups
    outline = Polygon([xy[v] for v in rings[0]], [[xy[v] for v in r] for r in rings[1:]])
    if not outline.is_valid:
        return None
    under = {v: len(vertices) + k for k, (v, _) in enumerate(border)}
    points = np.array([*vertices, *((*xy[v], heights[0]) for v, _ in border)])
    ground = Face(tuple(tuple(under[v] for v in reversed(r)) for r in rings), Semantic.GROUND)
    closed = tuple(LineString([xy[u], xy[v]]) for u, v in border if (u, v) not in free)
    return _Part(Polyhedron(points, (*roofs, ground)), outline, closed, heights[1])


def _pieces(
    solid: Polyhedron, edge: tuple[int, int], p: OverhangParameters
) -> tuple[list[tuple[float, float, bool]], float]:
    """Shares of a border's length where each piece begins and ends, and whether a lower roof of the unit is far enough below it; and its height."""
    a, b = solid.vertices[edge[0]], solid.vertices[edge[1]]
    length = float(np.hypot(*(b - a)[:2]))
    if length < SHORTEST_M:
        return [(0.0, 1.0, False)], np.inf
    count = max(2, int(length / STEP_M))
    share = (np.arange(count) + 0.5) / count
    top = a + share[:, None] * (b - a)
    out = np.array([(b - a)[1], -(b - a)[0]]) / length
    lower = -roof_hits(solid, np.column_stack([top[:, :2] + OUT_M * out, np.zeros(count)]))[1]
    is_free = np.asarray(np.isfinite(lower) & (lower < top[:, 2] - p.least_drop_m - p.slab_m - WALL_LEFT_M))
    ends = np.concatenate([[0], np.flatnonzero(np.diff(is_free)) + 1, [count]])
    pieces = [
        (s / count, e / count, bool(is_free[s]) and (e - s) * length / count >= SHORTEST_M)
        for s, e in pairwise(ends.tolist())
    ]
    return pieces, float(lower[is_free].min(initial=np.inf))


def _joined(surfaces: Sequence[Polyhedron]) -> Polyhedron:
    """All faces together."""
    faces, first = [], 0
    for one in surfaces:
        faces += [replace(f, rings=tuple(tuple(v + first for v in ring) for ring in f.rings)) for f in one.faces]
        first += len(one.vertices)
    return Polyhedron(np.concatenate([one.vertices for one in surfaces]), tuple(faces))
