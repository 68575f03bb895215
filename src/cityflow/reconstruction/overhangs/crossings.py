"""Vertices where the upper or lower sides of two neighbouring cells cross along their common edge."""

from __future__ import annotations

from cityflow.core.building import VERTEX_DECIMALS
from cityflow.reconstruction.overhangs.roof_plan import PlanCell, RoofPlan
from cityflow.reconstruction.solids.ring_tracing import Edge, ring_edges

NEAR_M = 0.004
"""Heights this near to each other at an end of an edge meet there."""


def split_crossings(plan: RoofPlan, slab_m: float) -> None:
    """Put a vertex wherever heights on both sides of an edge cross, so that a wall stands on one side of it only."""
    left = plan.left()
    for u, v in sorted((u, v) for u, v in left if u < v and (v, u) in left):
        one, two = plan.cells[left[u, v]], plan.cells[left[v, u]]
        if one.inside and two.inside:
            continue
        shares = sorted({round(s, 6) for s in _crossings(plan, one, two, (u, v), slab_m)})
        if shares:
            _insert(plan, (one, two), (u, v), shares)


def _crossings(plan: RoofPlan, one: PlanCell, two: PlanCell, edge: Edge, slab_m: float) -> list[float]:
    """Shares of the edge at which a side of one cell crosses a side of the other."""
    found = []
    for mine in _sides(plan, one, edge, slab_m):
        for its in _sides(plan, two, edge, slab_m):
            start, end = mine[0] - its[0], mine[1] - its[1]
            if start * end < 0 and min(abs(start), abs(end)) > NEAR_M:
                found.append(start / (start - end))
    return found


def _sides(plan: RoofPlan, cell: PlanCell, edge: Edge, slab_m: float) -> list[tuple[float, float]]:
    top = cell.tops[edge[0]], cell.tops[edge[1]]
    low = (plan.floor, plan.floor) if cell.inside else (top[0] - slab_m, top[1] - slab_m)
    return [top, low]


def _insert(plan: RoofPlan, cells: tuple[PlanCell, PlanCell], edge: Edge, shares: list[float]) -> None:
    (x1, y1), (x2, y2) = plan.xy[edge[0]], plan.xy[edge[1]]
    between = []
    for share in shares:
        x, y = x1 + share * (x2 - x1), y1 + share * (y2 - y1)
        between.append(plan.vertex(round(x, VERTEX_DECIMALS), round(y, VERTEX_DECIMALS)))
    for cell in cells:
        start, end = cell.tops[edge[0]], cell.tops[edge[1]]
        for vertex, share in zip(between, shares, strict=True):
            cell.tops[vertex] = start + share * (end - start)
        cell.rings = [_with(ring, edge, between) for ring in cell.rings]


def _with(ring: list[int], edge: Edge, between: list[int]) -> list[int]:
    longer: list[int] = []
    for pair in ring_edges(ring):
        longer.append(pair[0])
        if pair == edge:
            longer += between
        elif pair == edge[::-1]:
            longer += between[::-1]
    return longer
