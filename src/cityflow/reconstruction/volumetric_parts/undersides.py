"""Voids under a building: passages, arcades, storeys that stand out over a wall set back.

No image from the air shows an underside. What shows a void is the wall behind it: it is seen, so that nothing stands before it at
its height, although a roof covers the place. The lines from its points towards those who see them are open; what lies behind
any wall is solid. Both are counted on a fine raster and weighed in one minimum cut over the columns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.geometry.min_cut import min_cut
from cityflow.reconstruction.partition.cell_evidence import points_in_cells
from cityflow.reconstruction.partition.cut_lines import main_directions
from cityflow.reconstruction.partition.plane_energy import inner_edges
from cityflow.reconstruction.partition.roof_partition import cut_cells
from cityflow.reconstruction.partition.step_lines import angle_between
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.volumetric_parts.facades import Facade, FacadeCloud, end_lines

RASTER_M = 0.25
"""Cells on which places seen open and solid are counted; set by hand."""
LEAST_ABOVE = 10
"""Points that the outer wall over a void must show; set by hand."""
SCALE = 1e6
"""Minimum cuts count in whole numbers: square millimetres."""
SET_BACK, LEAST_LENGTH, LEAST_COVER, NEAR_EDGE = 0.8, 1.5, 1.2, 0.4
"""Metres: walls nearer to the outline are windows, doors, recesses; the shortest wall that tells of a void; what stands over a void is at least so high;
points nearer to the outline are of an outer wall. Set by hand, as are the next two."""
SOLID_WEIGHT = 2.0
"""A square metre seen solid weighs so much more than one seen open."""
TURN_DEG, BASE_M = 8.0, 1.5
"""Such a wall runs along a main direction of the outline (±), and is seen down to this height (m) over the floor."""
LEAST_HEIGHT, LEAST_AREA_M2 = 1.8, 2.0
"""Lowest void (m), a little less than a door; smallest void in plan; set by hand."""


class UndersideParameters(Parameters):
    """When a part of a building stands over a void."""

    search: bool = Field(True, description="voids under roofs are searched")
    depth: float = Field(8.0, gt=0, le=50, description="a wall shows a void at most this far (m) in front of it")
    prior: float = Field(0.3, ge=0, le=1, description="share of a column that must be seen open")
    edge_cost: float = Field(0.2, ge=0, le=10, description="m² that a metre of a void's rim costs where no wall stands")
    min_points: int = Field(15, ge=1, le=10_000, description="fewest points on the walls behind a void")


@dataclass(frozen=True, slots=True)
class Voids:
    """Columns of a subdivision, its cells cut further.

    Attributes
    ----------
    surface : cell → surface on top
    ceiling : cell → local height (m) of its underside, for cells over a void
    """

    surface: dict[int, int]
    ceiling: dict[int, float]


@dataclass(frozen=True, slots=True)
class _Votes:
    """Places in plan, on the raster, each once: seen open, and seen solid, below the ceiling."""

    open_: FloatArray
    solid: FloatArray


class SeenFacades(NamedTuple):
    """Façade cloud and façades of a building, its outline (local), local height of its floor."""

    cloud: FacadeCloud
    facades: list[Facade]
    outline: Polygon
    floor: float


def find_voids(
    division: Subdivision,
    surface: dict[int, int],
    segments: PlaneSegments,
    evidence: SeenFacades,
    parameters: UndersideParameters,
) -> Voids:
    """Cut the columns along walls that stand under a roof, and find those with nothing under them.

    Parameters
    ----------
    division : local frame; it is cut
    surface : of each cell
    segments : roof surfaces, local frame
    evidence : what images show of its façades
    """
    cloud, facades, outline, floor = evidence
    planes = segments.coefficients
    behind = [f for f in facades if parameters.search and _tells(f, outline, floor)]
    behind = [f for f in behind if _is_under_roof(f, division, surface, planes)]
    if sum(len(f.points) for f in behind) < parameters.min_points:
        return Voids(surface, {})
    surface = _cut(division, surface, behind)
    outer = _on_outer_walls(cloud, outline, NEAR_EDGE)
    votes = _votes(cloud, behind, outer, outline, parameters)
    is_void = _labelled(division, votes, behind, parameters)
    ceiling: dict[int, float] = {}
    for part in _connected(division, is_void):
        height = _ceiling(division, part, cloud, behind, outer)
        if height is not None and height - floor >= LEAST_HEIGHT:
            covered = [c for c in part if _lowest_top(division, c, planes[surface[c]]) >= height + LEAST_COVER]
            if sum(division.area(c) for c in covered) >= LEAST_AREA_M2:
                ceiling.update(dict.fromkeys(covered, height))
    return _merged(division, surface, ceiling)


def _tells(facade: Facade, outline: Polygon, floor: float) -> bool:
    """A wall known from its outer side, upright from near the floor to above a door's height, well inside the outline."""
    line = facade.line
    if not facade.faces or line.end - line.start < LEAST_LENGTH:
        return False
    if facade.low - floor > BASE_M or facade.high - floor < LEAST_HEIGHT - 0.3:
        return False
    direction = math.atan2(line.nx, -line.ny) % math.pi
    turn = min(angle_between(direction, d) for d in main_directions(outline))
    t = np.linspace(line.start, line.end, 9)
    places = shapely.points(line.nx * line.offset - line.ny * t, line.ny * line.offset + line.nx * t)
    deep = float(np.median(shapely.distance(places, outline.boundary)))
    return turn <= math.radians(TURN_DEG) and deep >= SET_BACK


def _is_under_roof(facade: Facade, division: Subdivision, surface: dict[int, int], planes: FloatArray) -> bool:
    """On both sides of most of the façade stands a roof well above it."""
    line = facade.line
    t = np.linspace(line.start, line.end, 9)[1:-1]
    x, y = line.nx * line.offset - line.ny * t, line.ny * line.offset + line.nx * t
    numbers = list(division.cells)
    for side in (-0.4, 0.4):
        px, py = x + side * line.nx, y + side * line.ny
        cell = points_in_cells(division, numbers, px, py)
        inside = cell >= 0
        top = np.full(len(t), -np.inf)
        plane: FloatArray = planes[[surface[numbers[c]] for c in cell[inside]]].reshape(-1, 3)
        top[inside] = plane[:, 0] * px[inside] + plane[:, 1] * py[inside] + plane[:, 2]
        if np.mean(top >= facade.high + LEAST_COVER) < 0.6:
            return False
    return True


def _cut(division: Subdivision, surface: dict[int, int], behind: list[Facade]) -> dict[int, int]:
    """Cut along the façades and square to their ends; surfaces of the parts."""
    before = {number: division.polygon(number) for number in division.cells}
    cut_cells(division, [*(f.line for f in behind), *end_lines(behind)], 20 * len(before) + 200)
    shapes, owner = shapely.STRtree(list(before.values())), list(before)
    out = {}
    for number in division.cells:
        if number in surface:
            out[number] = surface[number]
        else:
            middle = division.polygon(number).representative_point()
            out[number] = surface[owner[int(shapes.query(middle, predicate="intersects").min())]]
    return out


def _on_outer_walls(cloud: FacadeCloud, outline: Polygon, near: float) -> BoolArray:
    points = shapely.points(cloud.xyz[:, :2])
    known = np.isfinite(cloud.normal[:, 0])
    return np.asarray(known & (shapely.distance(outline.boundary, points) <= near))


def _votes(
    cloud: FacadeCloud, behind: list[Facade], outer: BoolArray, outline: Polygon, parameters: UndersideParameters
) -> _Votes:
    open_, solid = [], []
    shapely.prepare(outline)
    highest = max(f.high for f in behind)
    walls = shapely.union_all([shapely.LineString([f.line.at(f.line.start), f.line.at(f.line.end)]) for f in behind])
    for f in behind:
        xy = cloud.xyz[f.points, :2]
        free = _free_run(f, xy, walls, outline, parameters.depth)
        steps = np.arange(0.3, parameters.depth, RASTER_M)
        reach = steps[None, :] < free[:, None]
        places = xy[:, None] + steps[None, :, None] * np.array([f.line.nx, f.line.ny])
        open_.append(places[reach])
        solid.append(_behind(xy, np.array([f.line.nx, f.line.ny])))
    # Only what stands lower than the walls behind the void speaks against it.
    low = np.flatnonzero(outer & (cloud.xyz[:, 2] < highest - 0.3))
    solid.append(_behind(cloud.xyz[low, :2], cloud.normal[low]))
    return _Votes(_once(np.concatenate(open_)), _once(np.concatenate(solid)))


def _free_run(facade: Facade, xy: FloatArray, walls: shapely.Geometry, outline: Polygon, depth: float) -> FloatArray:
    """(K,) metres before each point that are inside the outline and before the next wall."""
    n = np.array([facade.line.nx, facade.line.ny])
    rays = shapely.linestrings(np.stack([xy + 0.3 * n, xy + depth * n], axis=1))
    stops = shapely.union(outline.boundary, walls)
    start = shapely.points(xy)
    hits = shapely.intersection(rays, stops)
    free = np.where(shapely.is_empty(hits), depth, shapely.distance(start, hits))
    return np.asarray(np.where(shapely.contains_xy(outline, *(xy + 0.3 * n).T), free, 0.0))


def _behind(xy: FloatArray, normal: FloatArray) -> FloatArray:
    steps = np.array([0.3, 0.55, 0.8])
    return np.asarray((xy[:, None] - steps[None, :, None] * np.broadcast_to(normal, xy.shape)[:, None]).reshape(-1, 2))


def _once(xy: FloatArray) -> FloatArray:
    """Middles of the raster's cells that hold places, each once."""
    return np.asarray((np.unique(np.floor(xy / RASTER_M), axis=0) + 0.5) * RASTER_M)


def _labelled(
    division: Subdivision, votes: _Votes, behind: list[Facade], parameters: UndersideParameters
) -> dict[int, bool]:
    numbers = list(division.cells)
    area = np.array([division.area(n) for n in numbers])
    seen = [
        RASTER_M**2 * np.bincount(cell[cell >= 0], minlength=len(numbers))
        for cell in (
            points_in_cells(division, numbers, xy[:, 0].copy(), xy[:, 1].copy()) for xy in (votes.open_, votes.solid)
        )
    ]
    as_void = SOLID_WEIGHT * seen[1] + parameters.prior * area
    pairs, ends = inner_edges(division)
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    for f in behind:
        on = np.abs(ends @ (f.line.nx, f.line.ny) - f.line.offset).max(axis=1, initial=0) < 0.02
        length = np.where(on, 0.0, length)
    source, sink = len(numbers), len(numbers) + 1
    every = np.arange(len(numbers))
    tail = np.concatenate([np.full(len(numbers), source), every, pairs[:, 0], pairs[:, 1]])
    head = np.concatenate([every, np.full(len(numbers), sink), pairs[:, 1], pairs[:, 0]])
    rim = parameters.edge_cost * length
    room = np.round(SCALE * np.concatenate([as_void, seen[0], rim, rim])).astype(np.int64)
    solid = min_cut(tail, head, room, len(numbers) + 2)
    return {number: not bool(solid[k]) for k, number in enumerate(numbers)}


def _connected(division: Subdivision, is_void: dict[int, bool]) -> list[list[int]]:
    left = [n for n in division.cells if is_void[n]]
    parts = []
    while left:
        part, queue = [], [left[0]]
        left.remove(queue[0])
        while queue:
            cell = queue.pop()
            part.append(cell)
            for other in division.neighbours(cell):
                if other in left:
                    left.remove(other)
                    queue.append(other)
        parts.append(sorted(part))
    return parts


def _ceiling(
    division: Subdivision, part: list[int], cloud: FacadeCloud, behind: list[Facade], outer: BoolArray
) -> float | None:
    """Height of the underside, where the outer wall above the void begins; None where no such wall is seen."""
    shape = shapely.union_all([division.polygon(n) for n in part])
    wall = np.concatenate([f.points for f in behind])
    wall = wall[shapely.contains_xy(shapely.buffer(shape, 0.5), *cloud.xyz[wall, :2].T)]
    if len(wall) == 0:
        return None
    top = float(np.percentile(cloud.xyz[wall, 2], 98))
    # Points whose wall has the void behind it; walls beside the void have not.
    above = np.setdiff1d(np.flatnonzero(outer), wall)
    above = above[
        shapely.contains_xy(shapely.buffer(shape, -0.25), *(cloud.xyz[above, :2] - 0.7 * cloud.normal[above]).T)
    ]
    if len(above) < LEAST_ABOVE:
        return None  # an outline that is too large, rather than a storey that stands out
    fourth, further = np.percentile(cloud.xyz[above, 2], (4, 24))
    begins = float(fourth - 0.2 * (further - fourth))  # where points that stand evenly on the wall begin
    return begins if begins >= top - 0.8 else None


def _lowest_top(division: Subdivision, cell: int, plane: FloatArray) -> float:
    xy = np.array([division.xy[v] for ring in division.cells[cell] for v in ring])
    return float((xy @ plane[:2] + plane[2]).min())


def _merged(division: Subdivision, surface: dict[int, int], ceiling: dict[int, float]) -> Voids:
    """Cells of one surface and one underside united."""
    levels = sorted(set(ceiling.values()))
    kinds = len(levels) + 1
    label = {n: surface[n] * kinds + (levels.index(ceiling[n]) + 1 if n in ceiling else 0) for n in division.cells}
    label = division.merge(label)
    division.dissolve()
    out = {n: label[n] // kinds for n in division.cells}
    return Voids(out, {n: levels[label[n] % kinds - 1] for n in division.cells if label[n] % kinds})
