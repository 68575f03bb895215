"""Where single units of a terrace are to be cut apart, which traces each cut has, and the blocks before the cuts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely import LineString, Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.synthetic.town_drafts import Finish
from cityflow.synthetic.town_units import Gap, Unit

SHORTEST_M = 1.0
"""Touching along less than this is a corner, no party wall."""
HEIGHT_TRACE_M = 0.15
COLOUR_TRACE = 12
SLOPE_TRACE = 0.05
ASIDE_M = 0.08


@dataclass(frozen=True, slots=True)
class CutLine:
    """Border between two units.

    Attributes
    ----------
    line : in plan, world metres; through the middle of a gap
    units : indices into `Town.units`
    height : the roofs differ by more than 0.15 m along it
    roof : they differ in colour, material or slope
    facade : the façades differ in colour or material, or a drain pipe marks the border
    gap : the units do not touch;  tree : the gap is filled by a tree
    """

    line: LineString
    units: tuple[int, int]
    height: bool
    roof: bool
    facade: bool
    gap: bool
    tree: bool = False

    @property
    def none(self) -> bool:
        """True where nothing at all shows the border."""
        return not (self.height or self.roof or self.facade or self.gap)


@dataclass(frozen=True, slots=True)
class Block:
    """Units that touch, as one outline; gaps filled by a tree belong to it."""

    id: str
    outline: Polygon
    units: tuple[int, ...]
    filled_gaps: int


def cut_lines(units: Sequence[Unit], gaps: Sequence[Gap]) -> tuple[CutLine, ...]:
    """All borders between touching units, then those in gaps."""
    lines = []
    for i, j in touching(units):
        line = _common_line(units[i], units[j])
        if line is not None:
            lines.append(_judged(line, (units[i], units[j]), None))
    for gap in gaps:
        c = shapely.get_coordinates(gap.polygon)
        line = LineString([(c[0] + c[1]) / 2, (c[3] + c[2]) / 2])
        lines.append(_judged(line, (units[gap.between[0]], units[gap.between[1]]), gap))
    return tuple(lines)


def touching(units: Sequence[Unit]) -> list[tuple[int, int]]:
    """Pairs of units whose wall outlines touch, ordered."""
    outlines = np.array([u.wall_outline for u in units], dtype=object)
    if len(outlines) == 0:
        return []
    a, b = shapely.STRtree(outlines).query(outlines, predicate="dwithin", distance=1e-5)
    pairs = np.unique(np.column_stack([a, b])[a < b], axis=0)
    return [(int(i), int(j)) for i, j in pairs]


def _common_line(a: Unit, b: Unit) -> LineString | None:
    """Edges that both outlines have, as one line; None where they only meet in a corner."""
    edges_a, edges_b = _edges(a.wall_outline), _edges(b.wall_outline)
    shared = [edge for key, edge in edges_a.items() if key in edges_b]
    if not shared:
        return None
    merged = shapely.line_merge(shapely.multilinestrings(shared))
    line = max(shapely.get_parts(merged), key=lambda part: part.length)
    return line if line.length >= SHORTEST_M else None


def _edges(outline: Polygon) -> dict[tuple[tuple[float, float], ...], FloatArray]:
    ring = shapely.get_coordinates(outline.exterior)
    pairs = ((tuple(p.tolist()), tuple(q.tolist())) for p, q in pairwise(ring))
    return {(min(p, q), max(p, q)): np.array([p, q]) for p, q in pairs}


def _judged(line: LineString, pair: tuple[Unit, Unit], gap: Gap | None) -> CutLine:
    a, b = pair
    reach = ASIDE_M if gap is None else 1.3
    step = float(np.nanmax(np.abs(_roof_steps(line, pair, reach)), initial=0.0))
    neighbours = a.row != "" and a.row == b.row and b.index == a.index + 1
    return CutLine(
        line,
        (a.index, b.index),
        step > HEIGHT_TRACE_M,
        _differ(a.style.roof, b.style.roof) or _slopes_differ(a, b),
        _differ(a.style.facade, b.style.facade) or (neighbours and (a.pipes[1] or b.pipes[0])),
        gap is not None,
        gap is not None and gap.tree,
    )


def _roof_steps(line: LineString, pair: tuple[Unit, Unit], reach: float) -> FloatArray:
    """Height of one roof less that of the other at places along the line, each `reach` within its own unit."""
    t = np.linspace(0.05, 0.95, 13) * line.length
    at = shapely.get_coordinates(shapely.line_interpolate_point(line, t))
    ends = shapely.get_coordinates(line)[[0, -1]]
    d = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    aside = reach * np.array([-d[1], d[0]])
    left, right = at + aside, at - aside
    inside = shapely.intersects_xy(pair[0].wall_outline, *left.mean(axis=0))
    first, second = (left, right) if inside else (right, left)
    steps = pair[0].z(*first.T) - pair[1].z(*second.T)
    return np.where(np.isfinite(steps), steps, np.nan) if np.isfinite(steps).any() else np.zeros(1)


def _differ(a: Finish, b: Finish) -> bool:
    return a.material != b.material or max(abs(p - q) for p, q in zip(a.tint, b.tint, strict=True)) > COLOUR_TRACE


def _slopes_differ(a: Unit, b: Unit) -> bool:
    """True where the main roof faces do not fall alike."""
    return any(
        max(abs(f.slope_u - g.slope_u), abs(f.slope_v - g.slope_v)) > SLOPE_TRACE
        for f, g in zip(a.volumes[0].faces, b.volumes[0].faces, strict=False)
    ) or len(a.volumes[0].faces) != len(b.volumes[0].faces)


def blocks_of(units: Sequence[Unit], gaps: Sequence[Gap]) -> tuple[Block, ...]:
    """Outlines as a cadastre of blocks gives them: what touches is one, gaps filled by a tree belong to it."""
    trees = [g for g in gaps if g.tree]
    pairs = np.array([*touching(units), *(g.between for g in trees)], np.int64).reshape(-1, 2)
    size = (len(units), len(units))
    _, label = connected_components(coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=size), False)
    members: dict[int, list[int]] = {}
    for k, number in enumerate(label.tolist()):
        members.setdefault(number, []).append(k)
    filled: dict[int, list[Gap]] = {}
    for gap in trees:
        filled.setdefault(int(label[gap.between[0]]), []).append(gap)
    return tuple(_block(n, units, members[n], filled.get(n, [])) for n in members)


def _block(number: int, units: Sequence[Unit], rows: Sequence[int], filled: Sequence[Gap]) -> Block:
    shapes = [units[k].wall_outline for k in rows] + [g.polygon for g in filled]
    if len(shapes) == 1:
        outline = shapes[0]
    else:
        closed = shapely.buffer(
            shapely.buffer(shapely.union_all(shapes), 1e-3, join_style="mitre"), -1e-3, join_style="mitre"
        )
        outline = max(shapely.get_parts(closed), key=lambda p: p.area)
    return Block(f"k{number + 1:05d}", orient(outline), tuple(rows), len(filled))
