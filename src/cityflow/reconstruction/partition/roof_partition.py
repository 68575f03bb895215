"""Partition of an outline in roof polygons, one plane each.

The outline is cut by intersection and step lines where these matter; the cells get planes by energy minimisation over
the points, and cells of one plane are united. Gross et al. 2005, section 3, beyond its description: the result covers
the outline without gaps or overlaps for any planes.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from numba import njit
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.partition.borders import find_borders
from cityflow.reconstruction.partition.cell_evidence import plane_costs, points_in_cells
from cityflow.reconstruction.partition.cut_lines import (
    intersection_lines,
    main_directions,
    on_outline,
    outline_extensions,
    without_doubles,
)
from cityflow.reconstruction.partition.labelling import label_cells
from cityflow.reconstruction.partition.partition_values import RoofPartition, single_cell
from cityflow.reconstruction.partition.second_look import Patch, lines_around, missed_patches
from cityflow.reconstruction.partition.simplification import PLANE_NUMBERS, without_worthless
from cityflow.reconstruction.partition.step_lines import step_lines
from cityflow.reconstruction.partition.subdivision import MIN_EDGE, CutLine, Subdivision
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.solids.ring_tracing import Edge, ring_edges

MAX_ROUNDS = 3
"""So often cells are labelled; after each round the lines that carry too little of the roof's edges are left out."""

LOOKS, MOST_PATCHES = 2, 12
"""So often, and so many at a time, patches of points that a roof misses are looked at again."""


class PartitionParameters(Parameters):
    """How an outline is cut, and what an edge must be worth."""

    reach: float = Field(1.0, gt=0, le=5, description="segments nearer than this (m) are neighbours")
    gap: float = Field(4.0, gt=0, le=50, description="so far (m) across stretches without planes")
    min_length: float = Field(0.7, gt=0, le=10, description="shortest line (m) along which the outline is cut")
    min_width: float = Field(0.6, ge=0, le=5, description="narrower roof polygons (m) go unless points demand them")
    tolerance: float = Field(0.15, gt=0, le=2, description="vertical miss (m) from which a point counts as unexplained")
    edge_cost: float = Field(0.15, ge=0, le=10, description="m² of unexplained roof that a metre of edge must save")
    step_cost: float = Field(
        0.2, ge=0, le=10, description="the same for a metre of edge per metre of height step along it"
    )
    step_limit: float = Field(0.3, gt=0, le=100, description="higher steps (m) cost no more than this one")
    number_cost: float = Field(
        0.6,
        ge=0,
        le=100,
        description="unexplained independent points that each number of a polygon's description must save",
    )
    alike_m: float = Field(
        0.3,
        ge=0,
        le=5,
        description="points nearer to each other than this (m) err alike: together they are one independent point",
    )
    max_lines: int = Field(80, ge=1, le=1000, description="most lines considered for one outline")
    max_cells: int = Field(200, ge=1, le=5000, description="cutting ends at this number of cells")


def partition_roof(
    outline: Polygon, segments: PlaneSegments, parameters: PartitionParameters
) -> tuple[RoofPartition, list[Patch]]:
    """Cells of the outline, each with one of the planes; and patches of points that these miss though they are worth a polygon.

    Parameters
    ----------
    outline : local xy (metres), holes allowed
    segments : planes and points in the same local frame; at least one plane
    """
    if len(segments) < 1:
        raise ValueError("a partition needs at least one plane")
    if len(segments) == 1:
        partition = single_cell(outline)
        return partition, _missed(partition, segments, PlaneEnergy(segments, parameters, outline.area))
    energy = PlaneEnergy(segments, parameters, outline.area)
    lines = candidate_lines(outline, segments, parameters)
    partition = partition_along(outline, lines, energy, parameters)
    missed = _missed(partition, segments, energy)
    for _ in range(LOOKS):
        closer = without_doubles([*lines, *_lines_around(outline, missed, energy)], 0.1)
        if closer == lines:
            break
        lines = closer
        other = partition_along(outline, lines, energy, parameters)
        if energy.total(other) >= energy.total(partition):
            break
        partition, missed = other, _missed(other, segments, energy)
    return partition, missed


def _lines_around(outline: Polygon, missed: list[Patch], energy: PlaneEnergy) -> list[CutLine]:
    """Lines around the largest patches of points that a roof misses."""
    directions, margin = main_directions(outline), math.sqrt(energy.area_of_point) / 2
    lines = [line for patch in missed[:MOST_PATCHES] for line in lines_around(patch, directions, margin)]
    return on_outline(lines, outline, 0.3)


def _missed(partition: RoofPartition, segments: PlaneSegments, energy: PlaneEnergy) -> list[Patch]:
    """Connected points of found planes that a roof misses, where they are worth a polygon."""
    least = PLANE_NUMBERS * energy.number_price / energy.area_of_point
    reach = max(energy.parameters.reach, 2.0 * math.sqrt(energy.area_of_point))
    return missed_patches(partition, energy.planes, segments, (energy.tolerance, least, reach))


def partition_along(
    outline: Polygon, lines: list[CutLine], energy: PlaneEnergy, parameters: PartitionParameters
) -> RoofPartition:
    """Cells between given lines, each with the plane that the energy gives it; lines earlier in the list cut first."""
    for _ in range(MAX_ROUNDS):
        division = Subdivision.of_polygon(outline)
        cut_cells(division, lines, parameters.max_cells)
        labels = energy.minimise(division)
        useful = useful_lines(division, labels, lines, energy)
        if len(useful) == len(lines):
            break
        lines = useful
    labels = division.merge(labels)
    labels = without_slivers(division, labels, energy, parameters.min_width)
    labels = without_worthless(division, labels, energy, energy.number_price)
    division.dissolve()
    return RoofPartition.of_subdivision(division, labels)


def least(line: CutLine, parameters: PartitionParameters) -> float:
    """Metres of roof edge that a line must carry: intersections follow from planes, other lines are guesses."""
    return parameters.min_length / 2 if line.is_crossing else parameters.min_length


def useful_lines(
    division: Subdivision, labels: dict[int, int], lines: list[CutLine], energy: PlaneEnergy
) -> list[CutLine]:
    """Lines that carry enough of the roof's edges, or whose few decimetres part what cannot be one: the neck beside a slit."""
    parting = _parting_edges(division, labels)
    if not parting:
        return [line for line in lines if least(line, energy.parameters) <= 0]
    ends = np.array(division.xy)[np.array(parting)]
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    on = [np.abs(ends @ (line.nx, line.ny) - line.offset).max(axis=1) <= 2 * MIN_EDGE for line in lines]
    short = [0 < length[mask].sum() < least(line, energy.parameters) for mask, line in zip(on, lines, strict=True)]
    saved = _saved(division, labels, parting, energy) if any(short) else np.zeros(len(parting))
    return [
        line
        for line, mask in zip(lines, on, strict=True)
        if length[mask].sum() >= least(line, energy.parameters)
        or saved[mask].max(initial=0.0) > PLANE_NUMBERS * energy.number_price
    ]


def _parting_edges(division: Subdivision, labels: dict[int, int]) -> list[Edge]:
    """Edges between cells of different planes, each once."""
    edges = [(u, v) for u, v in division.left if u < v and (v, u) in division.left]
    return [(u, v) for u, v in edges if labels[division.left[u, v]] != labels[division.left[v, u]]]


def _saved(division: Subdivision, labels: dict[int, int], edges: list[Edge], energy: PlaneEnergy) -> FloatArray:
    """(E,) m² that the planes of the two cells at an edge explain more than one of them would in both."""
    numbers = list(division.cells)
    cost, _ = energy.costs(division, numbers)
    of = dict(zip(numbers, cost, strict=True))

    def with_its_own(number: int) -> FloatArray:
        """Costs of a cell; of one too small to hold a point together with those of its plane beside it."""
        if division.area(number) >= energy.area_of_point:
            return of[number]
        beside = [n for n in division.neighbours(number) if labels[n] == labels[number]]
        return np.asarray(of[number] + sum(of[n] for n in beside))

    saved = []
    for u, v in edges:
        i, j = division.left[u, v], division.left[v, u]
        mine, other = with_its_own(i), with_its_own(j)
        saved.append(min(mine[labels[j]] - mine[labels[i]], other[labels[i]] - other[labels[j]]))
    return np.array(saved)


def candidate_lines(outline: Polygon, segments: PlaneSegments, parameters: PartitionParameters) -> list[CutLine]:
    """All lines that may become roof edges, longest support first."""
    borders = find_borders(segments, parameters.reach, parameters.gap)
    crossings, explained = intersection_lines(segments, borders, parameters.min_length, parameters.reach)
    directions = main_directions(outline)
    steps = step_lines(borders.take(~explained), directions, parameters.min_length, parameters.max_lines)
    lines = [*crossings, *on_outline(steps, outline, 0.3), *outline_extensions(outline, parameters.min_length)]
    lines.sort(key=lambda line: -line.support)
    return without_doubles(lines, 0.1)[: parameters.max_lines]


def cut_cells(division: Subdivision, lines: list[CutLine], most: int) -> None:
    """Cut every cell that a line's stretch crosses; boxes tell which these may be."""
    numbers = list(division.cells)
    boxes = np.array([_bounds(division, number) for number in numbers])
    for line in lines:
        new: list[int] = []
        for k in _boxes_met(boxes, (line.nx, line.ny, line.offset, line.start, line.end)).tolist():
            if len(division.cells) >= most:
                return
            parts = division.cut(numbers[k], line)
            if parts != [numbers[k]]:
                new += parts
                # a cell that is no more meets no line
                boxes[k] = np.nan
        if new:
            numbers += new
            boxes = np.concatenate([boxes, [_bounds(division, number) for number in new]])


@njit(cache=True, nogil=True)
def _boxes_met(boxes: FloatArray, line: tuple[float, float, float, float, float]) -> IntArray:
    """Which of (N, 4) boxes (low x and y, high x and y) a line's stretch crosses."""
    nx, ny, offset, start, end = line
    met = np.empty(len(boxes), np.int64)
    count = 0
    for k in range(len(boxes)):
        x, y = (boxes[k, 0] + boxes[k, 2]) / 2, (boxes[k, 1] + boxes[k, 3]) / 2
        wide, high = (boxes[k, 2] - boxes[k, 0]) / 2, (boxes[k, 3] - boxes[k, 1]) / 2
        across = abs(x * nx + y * ny - offset) - (wide * abs(nx) + high * abs(ny))
        along = abs(y * nx - x * ny - (start + end) / 2) - (wide * abs(ny) + high * abs(nx))
        if across < 0 and along < (end - start) / 2:
            met[count] = k
            count += 1
    return met[:count]


def _bounds(division: Subdivision, number: int) -> tuple[float, float, float, float]:
    corners = [division.xy[v] for v in division.cells[number][0]]
    x, y = [x for x, _ in corners], [y for _, y in corners]
    return min(x), min(y), max(x), max(y)


class PlaneEnergy:
    """Cost of planes in cells, and of edges between cells of different planes."""

    def __init__(self, segments: PlaneSegments, parameters: PartitionParameters, area: float) -> None:
        self.points = np.ascontiguousarray(segments.points)
        self.planes = np.ascontiguousarray(segments.coefficients)
        self._abc = self.planes.tolist()
        self.tolerance = max(parameters.tolerance, 3 * segments.noise)
        self.area_of_point = area / max(len(segments.points), 1)
        self.parameters = parameters
        z = segments.points[:, 2]
        self.lowest, self.highest = float(z.min()) - 1.0, float(z.max()) + 1.0

    @property
    def number_price(self) -> float:
        """What a number of a description must save, m² of unexplained roof: the area of so many independent points."""
        return self.parameters.number_cost * (self.area_of_point + self.parameters.alike_m**2)

    def total(self, partition: RoofPartition) -> float:
        """Cost (m²) of a finished partition: what its planes leave unexplained, its edges, its polygons."""
        division, labels = partition.subdivision()
        numbers = list(division.cells)
        cost, _ = self.costs(division, numbers)
        unexplained = sum(float(cost[k, labels[n]]) for k, n in enumerate(numbers))
        edges = [
            (e, division.left[e], division.left[e[::-1]])
            for e in division.left
            if e < e[::-1] and e[::-1] in division.left
        ]
        borders = sum(self.border_cost(division, e, (labels[i], labels[j])) for e, i, j in edges)
        return unexplained + borders + PLANE_NUMBERS * self.number_price * len(numbers)

    def costs(self, division: Subdivision, numbers: list[int]) -> tuple[FloatArray, IntArray]:
        """(C, P) cost (m²) of each plane in each cell, and (C,) number of points in the cell."""
        cell = points_in_cells(division, numbers, self.points[:, 0].copy(), self.points[:, 1].copy())
        cost = plane_costs(self.points, cell, self.planes, self.tolerance, len(numbers)) * self.area_of_point
        count = np.bincount(cell[cell >= 0], minlength=len(numbers))
        if numbers:
            rings = [division.cells[number][0] for number in numbers]
            z = np.array([division.xy[v] for ring in rings for v in ring]) @ self.planes[:, :2].T + self.planes[:, 2]
            first = np.cumsum([0, *(len(ring) for ring in rings[:-1])])
            wild = np.logical_or.reduceat((z < self.lowest) | (z > self.highest), first)
            cost += wild * np.array([[division.area(number)] for number in numbers])
        return cost, count

    def minimise(self, division: Subdivision) -> dict[int, int]:
        """Plane of each cell."""
        numbers = list(division.cells)
        cost, _ = self.costs(division, numbers)
        pairs, pair_cost = self._pairs(division, {number: k for k, number in enumerate(numbers)})
        labels = label_cells(cost, pairs, pair_cost)
        return {number: int(label) for number, label in zip(numbers, labels, strict=True)}

    def _pairs(self, division: Subdivision, position: dict[int, int]) -> tuple[IntArray, FloatArray]:
        inner = [(u, v) for u, v in division.left if u < v and (v, u) in division.left]
        if not inner:
            return np.empty((0, 2), np.int64), np.empty((0, len(self.planes), len(self.planes)))
        pairs = np.array([[position[division.left[u, v]], position[division.left[v, u]]] for u, v in inner], np.int64)
        xy = np.array(division.xy)
        ends = xy[np.array(inner)]
        return pairs, self.edge_costs(ends)

    def border_cost(self, division: Subdivision, edge: Edge, planes: tuple[int, int]) -> float:
        """Cost (m²) of one edge between two planes."""
        mean = sum(min(step, self.parameters.step_limit) for step in self._steps(division, edge, planes)) / 2
        return (self.parameters.edge_cost + self.parameters.step_cost * mean) * division.length(edge)

    def is_step(self, division: Subdivision, edge: Edge, planes: tuple[int, int]) -> bool:
        """Whether two planes part at an edge rather than meet there."""
        return max(self._steps(division, edge, planes)) > self.tolerance

    def _steps(self, division: Subdivision, edge: Edge, planes: tuple[int, int]) -> tuple[float, float]:
        (a, b, c), (d, e, f) = self._abc[planes[0]], self._abc[planes[1]]
        a, b, c = a - d, b - e, c - f
        (x1, y1), (x2, y2) = division.xy[edge[0]], division.xy[edge[1]]
        return abs(a * x1 + b * y1 + c), abs(a * x2 + b * y2 + c)

    def edge_costs(self, ends: FloatArray) -> FloatArray:
        """(E, P, P) cost (m²) of each pair of planes along edges of (E, 2, 2) end points.

        Constant plus truncated height difference: a metric over planes, so that expansion moves are exact cuts.
        """
        z = ends @ self.planes[:, :2].T + self.planes[:, 2]
        step = np.minimum(np.abs(z[:, :, :, None] - z[:, :, None, :]), self.parameters.step_limit).mean(axis=1)
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        different = 1 - np.eye(len(self.planes))
        return (self.parameters.edge_cost * different + self.parameters.step_cost * step) * length[:, None, None]


def without_slivers(division: Subdivision, labels: dict[int, int], energy: PlaneEnergy, width: float) -> dict[int, int]:
    """Labels after narrow cells have joined the neighbour that explains their points best, narrowest first."""
    for _ in range(len(division.cells)):
        numbers = list(division.cells)
        narrow = [n for n in numbers if len(numbers) > 1 and _is_narrow(division, n, width)]
        if not narrow:
            break
        cost, count = energy.costs(division, narrow)
        moves = []
        for k, number in enumerate(narrow):
            others = sorted({labels[n] for n in division.neighbours(number)} - {labels[number]})
            if not others:
                continue
            best = min(others, key=lambda label: cost[k, label])
            loss = cost[k, best] - cost[k, labels[number]]
            # Points demand a narrow polygon where most of ten or more would be left unexplained without it.
            if count[k] >= 10 and loss > 0.6 * count[k] * energy.area_of_point:
                continue
            moves.append((division.area(number), number, best))
        if not moves:
            break
        _, number, label = min(moves)
        labels = division.merge({**labels, number: label})
    return labels


def _is_narrow(division: Subdivision, number: int, width: float) -> bool:
    perimeter = sum(division.length(edge) for ring in division.cells[number] for edge in ring_edges(ring))
    if 2 * division.area(number) / perimeter >= width:
        return False
    return bool(shapely.is_empty(division.polygon(number).buffer(-width / 2)))
