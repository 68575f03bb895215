"""A solid whose roof stands out beyond its walls: roof polygons extended in their own planes, with an underside parallel to them.

The walls stay where they are and end below the slab; the ground face stays the outline. The upright rim of the slab is a
wall surface like every other upright face, so that whoever adds up roof areas or reads slopes from roof faces finds none that is upright.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
import shapely.errors

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import EdgeOverhang, Polyhedron, Scalar
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.polyhedron import rings_of
from cityflow.geometry.validity import check_polygons, check_polyhedron
from cityflow.reconstruction.overhangs.crossings import split_crossings
from cityflow.reconstruction.overhangs.layered_solid import LayeredSolid
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.rim_edges import RimEdge, rim_edges
from cityflow.reconstruction.overhangs.rim_zones import rim_zones
from cityflow.reconstruction.overhangs.roof_plan import PlanCell, RoofPlan, UnfitRoof
from cityflow.reconstruction.overhangs.standing_wall import at_outline

BESIDE_M = 0.05
"""An edge of the solid this near to an overhang's line is a part of it; set by hand, as are those below."""
WALL_LEFT_M = 0.5
"""So much wall stays below the slab, at least."""
MOST_ATTEMPTS = 12
"""A fixed number, so that the result never depends on the clock."""


def with_overhangs(
    candidate: Candidate,
    overhangs: Sequence[EdgeOverhang],
    evidence: Evidence,
    parameters: OverhangParameters | None = None,
) -> Candidate:
    """The candidate with its roof extended, and what of that lies beyond the walls; with fewer overhangs, or none, where either would not be valid.

    Overhangs that count from a wall apart from the outline stand out as far as they reach beyond the outline, where the solid's walls are.

    The notes tell how many edges stand out (`overhang_edges`), how many had to be left (`overhangs_left`), and why (`overhang_reason`).
    """
    p = parameters or OverhangParameters()
    beyond = at_outline(overhangs, evidence, p)
    wanted = [k for k, o in enumerate(beyond) if o.reach_m > 0]
    if candidate.solid is None or not wanted:
        return replace(candidate, overhangs=tuple(overhangs))
    extended, kept, reason = _extended(candidate.solid, beyond, wanted, evidence, p)
    notes: dict[str, Scalar] = {
        **candidate.notes,
        "overhang_edges": len(kept),
        "overhangs_left": len(wanted) - len(kept),
    }
    if reason:
        notes["overhang_reason"] = reason
    left = set(wanted) - set(kept)
    done = tuple(replace(o, reach_m=0.0) if k in left else o for k, o in enumerate(overhangs))
    if extended is None:
        return replace(candidate, overhangs=done, notes=notes)
    return replace(candidate, solid=extended.solid, beyond=extended.beyond, overhangs=done, notes=notes)


@dataclass(frozen=True, slots=True)
class _Extended:
    """A closed solid with overhangs, and the surfaces of it that lie beyond the walls."""

    solid: Polyhedron
    beyond: Polyhedron

    def faults(self) -> str:
        """Names of the rules that one of them breaks."""
        found = check_polyhedron(self.solid) or check_polygons(rings_of(self.beyond))
        return ", ".join(sorted({fault.name for fault in found})).lower()


def _extended(
    solid: Polyhedron,
    overhangs: Sequence[EdgeOverhang],
    wanted: Sequence[int],
    evidence: Evidence,
    p: OverhangParameters,
) -> tuple[_Extended | None, tuple[int, ...], str]:
    """The solid with all overhangs, else with those that can be added one after the other, the longest first."""
    done, reason = _attempt(solid, overhangs, wanted, evidence, p)
    if done is not None:
        return done, tuple(wanted), ""
    order = sorted(wanted, key=lambda k: (-overhangs[k].line.length, k))[:MOST_ATTEMPTS]
    best: _Extended | None = None
    kept: list[int] = []
    for k in order:
        trial, _ = _attempt(solid, overhangs, [*kept, k], evidence, p)
        if trial is not None:
            best = trial
            kept.append(k)
    return best, tuple(sorted(kept)), reason


def _attempt(
    solid: Polyhedron,
    overhangs: Sequence[EdgeOverhang],
    chosen: Sequence[int],
    evidence: Evidence,
    p: OverhangParameters,
) -> tuple[_Extended | None, str]:
    """A valid solid with some of the overhangs, or why there is none."""
    try:
        plan = RoofPlan(solid)
        rims = _rims(plan, overhangs, chosen, evidence, p)
        cells = plan.add_outside(rim_zones(plan, rims, p.most_reach_m))
        _give_faces(plan, cells)
        split_crossings(plan, p.slab_m)
        layers = LayeredSolid(plan, p.slab_m)
        extended = _Extended(layers.polyhedron(), layers.beyond())
    except (UnfitRoof, shapely.errors.GEOSException) as problem:
        return None, str(problem)
    faults = extended.faults()
    return (None, faults) if faults else (extended, "")


def _rims(
    plan: RoofPlan, overhangs: Sequence[EdgeOverhang], chosen: Sequence[int], evidence: Evidence, p: OverhangParameters
) -> list[RimEdge]:
    edges = list(plan.border())
    world = np.asarray(plan.xy)
    ends = world[[u for u, _ in edges]], world[[v for _, v in edges]]
    party = np.zeros(len(edges), bool)
    if evidence.party:
        shared = shapely.union_all(list(evidence.party))
        near = [shapely.dwithin(shapely.points(e), shared, BESIDE_M) for e in (*ends, (ends[0] + ends[1]) / 2)]
        party = near[0] & near[1] & near[2]
    reach = _reaches(ends, party, overhangs, chosen)
    rims = rim_edges(plan, [float(r) for r in reach], [bool(b) for b in party], edges)
    if any(r.reach > 0 and min(r.tops) < plan.floor + p.slab_m + WALL_LEFT_M for r in rims):
        raise UnfitRoof("a wall is too low for an overhang")
    return rims


def _reaches(
    ends: tuple[FloatArray, FloatArray], party: BoolArray, overhangs: Sequence[EdgeOverhang], chosen: Sequence[int]
) -> FloatArray:
    """Reach of every piece of the outline: that of the nearest overhang's line, since near a corner a short piece is beside two."""
    lines = [o.line for o in overhangs]
    apart = np.array([np.maximum(*(shapely.distance(shapely.points(e), line) for e in ends)) for line in lines])
    nearest = np.argmin(apart, axis=0)
    beside = (np.min(apart, axis=0) <= BESIDE_M) & ~party
    if any(not (beside & (nearest == k)).any() for k in chosen):
        raise UnfitRoof("an overhang has no wall of the solid")
    reaches = np.array([o.reach_m if k in chosen else 0.0 for k, o in enumerate(overhangs)])
    return np.where(beside, reaches[nearest], 0.0)


def _give_faces(plan: RoofPlan, cells: Sequence[PlanCell]) -> None:
    """Every new cell continues the roof face that it touches along the greatest length, in that face's plane."""
    local, border = plan.local(), plan.border()
    waiting = list(cells)
    for _ in range(len(cells) + 1):
        owned = {e: c.face for c in cells if c.face >= 0 for e in c.edges()}
        left = []
        for cell in waiting:
            beside: dict[int, float] = {}
            for u, v in cell.edges():
                number = border.get((v, u))
                face = plan.cells[number].face if number is not None else owned.get((v, u), -1)
                weight = 1.0 if number is not None else 1e-3
                if face >= 0:
                    beside[face] = beside.get(face, 0.0) + weight * float(np.hypot(*(local[u] - local[v])))
            if not beside:
                left.append(cell)
                continue
            cell.face = max(sorted(beside), key=lambda face: beside[face])
            _give_heights(plan, cell)
        if not left or len(left) == len(waiting):
            break
        waiting = left
    if any(c.face < 0 for c in cells):
        raise UnfitRoof("a strip beyond the walls does not touch the roof")


def _give_heights(plan: RoofPlan, cell: PlanCell) -> None:
    own = [c for c in plan.cells if c.inside and c.face == cell.face]
    for vertex in dict.fromkeys(v for ring in cell.rings for v in ring):
        known = next((c.tops[vertex] for c in own if vertex in c.tops), None)
        cell.tops[vertex] = plan.height(cell.face, vertex) if known is None else known
