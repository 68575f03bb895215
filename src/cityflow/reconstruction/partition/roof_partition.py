"""Partition of an outline in roof polygons, one plane each.

The outline is cut by intersection and step lines where these matter; the cells get planes by energy minimisation over
the points, and cells of one plane are united. Gross et al. 2005, section 3, beyond its description: the result covers
the outline without gaps or overlaps for any planes.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.partition.borders import find_borders
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.cut_lines import (
    intersection_lines,
    main_directions,
    on_outline,
    outline_extensions,
    without_doubles,
)
from cityflow.reconstruction.partition.partition_values import RoofPartition, single_cell
from cityflow.reconstruction.partition.plane_energy import PartitionParameters, PlaneEnergy
from cityflow.reconstruction.partition.second_look import Patch, lines_around, missed_patches
from cityflow.reconstruction.partition.simplification import PLANE_NUMBERS, without_worthless
from cityflow.reconstruction.partition.step_lines import step_lines
from cityflow.reconstruction.partition.subdivision import MIN_EDGE, Subdivision
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.solids.ring_tracing import Edge, ring_edges

MAX_ROUNDS = 3
"""So often cells are labelled; after each round the lines that carry too little of the roof's edges are left out; set by hand."""

LOOKS, MOST_PATCHES = 2, 12
"""So often, and so many at a time, patches of points that a roof misses are looked at again."""


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
        for k in _boxes_met(boxes, (line.nx, line.ny, float(line.offset), line.start, line.end)).tolist():
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
