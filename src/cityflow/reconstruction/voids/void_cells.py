"""Which places of one storey are open: the outline cut along walls that are seen in it, and a minimum cut over its parts.

A point that is seen shows that the place in front of it is open, and that the place behind a wall is solid. Both are counted in plan on a fine raster.
Where nothing is seen, the storey stays solid.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.geometry.min_cut import min_cut
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.partition.borders import stretches
from cityflow.reconstruction.partition.cell_evidence import points_in_cells
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.plane_energy import inner_edges
from cityflow.reconstruction.partition.roof_partition import cut_cells
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.voids.facade_gaps import ON_M, Level
from cityflow.reconstruction.voids.seen_walls import FACING, INSIDE_M, SeenWalls

RASTER_M = 0.5
"""Cells on which places are counted, twice those that covered points are thinned to; set by hand, as all here."""
STEP_M = 0.25
"""Steps along rays."""
BIN_M, PLANE_M = 0.1, 0.3
"""Offsets of walls are counted in such bins; points so near to the fullest are of that wall."""
LEAST_LENGTH_M, GAP_M = 0.6, 2.5
SAME_DIRECTION_DEG, SAME_PLANE_DEG = 8.0, 3.0
NEXT_LINE_M = 0.15
"""Lines nearer to each other, or to the outline, are one."""
RISE = 0.6
"""Rays rise so much a metre at least: oblique views are steeper."""
RIM_M = 0.3
"""Points so near to the ends of a level may be of the floors there."""
BEHIND_M = (0.3, 0.55, 0.8)
MOST_CELLS = 200
SCALE = 1e6
"""Minimum cuts count in whole numbers: square millimetres."""
ROOFED_M = 0.25
"""So much of the model stands above a void at least."""


class CellParameters(Parameters):
    """When a place is open."""

    min_points: int = Field(15, ge=1, le=10_000, description="fewest points that a void is seen by, and a wall in it")
    depth: float = Field(8.0, gt=0, le=50, description="a wall shows an open place at most this far (m) in front of it")
    prior: float = Field(0.2, ge=0, le=1, description="share of a place that must be seen open")
    solid_weight: float = Field(
        2.0, gt=0, le=100, description="a square metre seen solid weighs so much more than one seen open"
    )
    edge_cost: float = Field(0.2, ge=0, le=10, description="m² that a metre of a void's rim costs where no wall stands")
    min_depth: float = Field(0.8, ge=0.3, le=10, description="shallowest void (m): found outlines may be off by less")
    min_area_m2: float = Field(2.0, gt=0, le=1000, description="smallest void in plan")


class Void(NamedTuple):
    """An open place of a storey: local plan, and the number of points that show it."""

    polygon: Polygon
    points: int


def find_voids(seen: SeenWalls, level: Level, drawn: list[CutLine], parameters: CellParameters) -> list[Void]:
    """The open places of one level.

    Parameters
    ----------
    drawn : lines of other levels; lines next to them are put onto them, and the others are added
    """
    p = parameters
    z = seen.xyz[:, 2]
    within = (z > level.low - 0.1) & (z < level.high)
    hidden = np.flatnonzero(seen.hidden & within)
    base = seen.level[np.abs(seen.level[:, 2] - level.low - 0.3) < 0.8]
    if len(hidden) + len(base) < p.min_points:
        return []
    walls = _walls(seen, hidden, p.min_points)
    division = Subdivision.of_polygon(seen.outline)
    lines = _on_drawn(_with_ends(walls, seen, level, p.depth), drawn)
    cut_cells(division, lines, MOST_CELLS)
    opened = _once(np.concatenate([_before(seen, hidden, level, p.depth), base[:, :2]]))
    inner = (z > level.low + RIM_M) & (z < level.high - RIM_M)
    solid = _once(_behind(seen, inner & ~_on_posts(seen, level)))
    numbers = list(division.cells)
    is_open = _labelled(division, opened, solid, lines[: len(walls)], p) & _roofed(division, numbers, seen, level.high)
    label = division.merge({n: int(is_open[k]) for k, n in enumerate(numbers)})
    division.dissolve()
    found = []
    for number, value in label.items():
        shape = division.polygon(number)
        if (
            value
            and shape.area >= p.min_area_m2
            and _depth(shape, seen) >= p.min_depth
            and _reaches(shape, seen, level)
        ):
            shapely.prepare(shape)
            count = int(shapely.contains_xy(shapely.buffer(shape, 0.1), *seen.xyz[hidden, :2].T).sum())
            found.append(Void(shape, count + int(shapely.contains_xy(shape, *base[:, :2].T).sum())))
    return [v for v in found if v.points >= p.min_points]


def _directions(edges: Sequence[WallEdge]) -> list[FloatArray]:
    """Unit vectors along and across the outline's edges, both ways, longest first; each direction once."""
    found: list[FloatArray] = []
    for edge in sorted(edges, key=lambda e: -e.length):
        for d in (edge.outward, edge.along, -edge.outward, -edge.along):
            if all(d @ f < np.cos(np.radians(SAME_DIRECTION_DEG)) for f in found):
                found.append(d)
    return found


def _walls(seen: SeenWalls, hidden: IntArray, least: int) -> list[CutLine]:
    """Walls that hidden points stand on, parallel to edges of the outline; normals point to those who see them."""
    directions = np.array(_directions(seen.edges))
    alike = seen.normal[hidden] @ directions.T
    nearest = np.where(alike.max(axis=1, initial=-1) >= FACING, np.argmax(alike, axis=1), -1)
    lines: list[CutLine] = []
    for k, (nx, ny) in enumerate(directions.tolist()):
        xy = seen.xyz[hidden[nearest == k], :2]
        offset, along = xy @ (nx, ny), xy @ (-ny, nx)
        while len(offset) >= least:
            first = float(offset.min())
            counts = np.convolve(np.bincount(((offset - first) / BIN_M).astype(int)), np.ones(3), "same")
            peak = first + (int(np.argmax(counts)) + 0.5) * BIN_M
            near = np.abs(offset - peak) <= PLANE_M
            if counts.max() < least:
                break
            place = float(np.median(offset[near]))
            for start, end in stretches(along[near], GAP_M):
                if end - start >= LEAST_LENGTH_M:
                    lines.append(CutLine(nx, ny, place, start, end, end - start))
            offset, along = offset[~near], along[~near]
    return sorted(lines, key=lambda line: -line.support)


def _with_ends(walls: Sequence[CutLine], seen: SeenWalls, level: Level, depth: float) -> list[CutLine]:
    """Walls, and lines inwards from the ends of openings; each line once, and none along the outline."""
    ends = []
    for o in level.openings:
        edge = seen.edges[o.edge]
        for s in (o.start, o.end):
            if 0 < s < edge.length:
                x, y = edge.start + s * edge.along
                nx, ny = edge.along
                middle = nx * y - ny * x
                # the inside is on the left of the edge, along (−ny, nx)
                ends.append(CutLine(nx, ny, float(nx * x + ny * y), middle, middle + depth, 0.0))
    lines: list[CutLine] = []
    border = [_of_edge(e) for e in seen.edges]
    for line in (*walls, *ends):
        if not any(_same(line, other) for other in (*border, *lines)):
            lines.append(line)
    return lines


def _of_edge(edge: WallEdge) -> CutLine:
    nx, ny = edge.outward.tolist()
    along = sorted(float(nx * y - ny * x) for x, y in (edge.xy[0], edge.xy[-1]))
    return CutLine(nx, ny, float(edge.outward @ edge.start), along[0], along[1], 0.0)


def _same(one: CutLine, other: CutLine) -> bool:
    turn = one.nx * other.nx + one.ny * other.ny
    if abs(turn) < np.cos(np.radians(SAME_DIRECTION_DEG)):
        return False
    ends = np.array([one.at(one.start), one.at(one.end)])
    near = np.abs(ends @ (other.nx, other.ny) - other.offset).max() <= NEXT_LINE_M
    along = sorted(float(other.along(*p)) for p in ends)
    shorter = min(along[1] - along[0], other.end - other.start)
    return bool(near and min(along[1], other.end) - max(along[0], other.start) > 0.5 * shorter)


def _on_drawn(lines: Sequence[CutLine], drawn: list[CutLine]) -> list[CutLine]:
    """Lines of this level on those of others where they are next to them: walls that stand over each other are one plane."""
    placed = []
    for line in lines:
        ends = np.array([line.at(line.start), line.at(line.end)])
        for other in drawn:
            way = line.nx * other.nx + line.ny * other.ny
            off = np.abs(ends @ (other.nx, other.ny) - other.offset).max()
            if abs(way) > np.cos(np.radians(SAME_PLANE_DEG)) and off <= NEXT_LINE_M:
                along = sorted(float(other.along(*p)) for p in ends)
                line = CutLine(other.nx, other.ny, other.offset, along[0], along[1], line.support)
                break
        else:
            drawn.append(line)
        placed.append(line)
    return placed


def _before(seen: SeenWalls, hidden: IntArray, level: Level, depth: float) -> FloatArray:
    """Places in front of hidden points, inside the outline, as far as a ray stays below the upper end of the level."""
    steps = np.arange(INSIDE_M, depth, STEP_M)
    at, n = seen.xyz[hidden], seen.normal[hidden]
    places = at[:, None, :2] + steps[None, :, None] * n[:, None]
    inside = shapely.contains_xy(seen.outline, places[..., 0], places[..., 1])
    below = at[:, 2, None] + RISE * steps[None] < level.high
    free = np.logical_and.accumulate(inside & below, axis=1)
    return np.asarray(places[free])


def _behind(seen: SeenWalls, within: BoolArray) -> FloatArray:
    at, n = seen.xyz[within, :2], seen.normal[within]
    return np.asarray((at[:, None] - np.array(BEHIND_M)[None, :, None] * n[:, None]).reshape(-1, 2))


def _on_posts(seen: SeenWalls, level: Level) -> BoolArray:
    """(N,) points on the façade within openings: of posts, behind which is open again."""
    found = np.zeros(len(seen.xyz), bool)
    for o in level.openings:
        edge = seen.edges[o.edge]
        plan = seen.xyz[:, :2] - edge.start
        s, t = plan @ edge.along, plan @ edge.outward
        found |= (np.abs(t) <= ON_M) & (s > o.start) & (s < o.end)
    return found


def _once(xy: FloatArray) -> FloatArray:
    """Middles of the raster's cells that hold places, each once."""
    cells = np.floor(xy / RASTER_M).astype(np.int64)
    numbers = np.unique((cells[:, 0] << 32) + cells[:, 1])
    column = (numbers + (1 << 31)) >> 32
    return np.asarray((np.column_stack([column, numbers - (column << 32)]) + 0.5) * RASTER_M)


def _labelled(
    division: Subdivision, opened: FloatArray, solid: FloatArray, walls: Sequence[CutLine], p: CellParameters
) -> BoolArray:
    """(C,) whether each cell is open."""
    numbers = list(division.cells)
    area = np.array([division.area(n) for n in numbers])
    counted = []
    for xy in (opened, solid):
        cell = points_in_cells(division, numbers, xy[:, 0].copy(), xy[:, 1].copy())
        counted.append(RASTER_M**2 * np.bincount(cell[cell >= 0], minlength=len(numbers)))
    pairs, ends = inner_edges(division)
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    for line in walls:
        on = np.abs(ends @ (line.nx, line.ny) - line.offset).max(axis=1, initial=0) < 0.02
        length = np.where(on, 0.0, length)
    count = len(numbers)
    every = np.arange(count)
    tail = np.concatenate([np.full(count, count), every, pairs[:, 0], pairs[:, 1]])
    head = np.concatenate([every, np.full(count, count + 1), pairs[:, 1], pairs[:, 0]])
    rim = p.edge_cost * length
    room = np.round(SCALE * np.concatenate([p.solid_weight * counted[1] + p.prior * area, counted[0], rim, rim]))
    return np.asarray(~min_cut(tail, head, room.astype(np.int64), count + 2)[:count])


def _roofed(division: Subdivision, numbers: Sequence[int], seen: SeenWalls, high: float) -> BoolArray:
    """(C,) whether the model stands high enough over each cell."""
    corners = [np.array([division.xy[v] for v in division.cells[n][0]]) for n in numbers]
    middles = [np.array(division.polygon(n).representative_point().coords) for n in numbers]
    return np.array(
        [bool(np.all(seen.top(m + 0.98 * (c - m)) > high + ROOFED_M)) for c, m in zip(corners, middles, strict=True)]
    )


def _depth(shape: Polygon, seen: SeenWalls) -> float:
    """Mean depth behind the outline, metres; infinite where it does not reach that."""
    open_m = float(shape.exterior.intersection(shapely.buffer(seen.outline.boundary, 0.01)).length)
    return shape.area / open_m if open_m > 0 else float("inf")


def _reaches(shape: Polygon, seen: SeenWalls, level: Level) -> bool:
    """Whether it lies behind an opening."""
    near = shapely.buffer(shape, 0.1)
    for o in level.openings:
        edge = seen.edges[o.edge]
        line = shapely.LineString([edge.start + s * edge.along for s in (o.start, o.end)])
        if near.intersection(line).length >= min(1.0, 0.5 * o.width):
            return True
    return False
