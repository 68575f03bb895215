"""The outline cut in columns, and the surface that tops each (Frommholz 2017, section 3: the polygonal hull).

Every edge of the hull lies, in plan, on a line where two roofs meet, on a wall, or on a step between roofs. These lines cut
the outline in polygons; a column stands on each, and the surface on top of it is found for all columns together: points that
are left unexplained, and metres of edge and of step between columns, cost as little as possible. A hull made of columns
is closed whatever surfaces are chosen, which a hull put together from edges is not.

Only surfaces that have points near a column can top it, so that the minimum cuts stay small with a hundred surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.partition.cell_evidence import plane_costs, points_in_cells
from cityflow.reconstruction.partition.roof_partition import line_use
from cityflow.reconstruction.partition.subdivision import CutLine, Subdivision
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.solids.ring_tracing import ring_edges
from cityflow.reconstruction.volumetric_parts.expansion import label_columns

ROUNDS = 3
"""So often columns are labelled; after each round the lines that carry too little of the hull's edges are left out."""
FORBIDDEN = 1e6
"""Cost (m²) of a surface that must not top a column."""


class ColumnParameters(Parameters):
    """How an outline is cut, and what an edge must be worth."""

    min_length: float = Field(0.7, gt=0, le=10, description="shortest line (m) along which the outline is cut")
    min_width: float = Field(0.6, ge=0, le=5, description="narrower roof polygons (m) go unless points demand them")
    tolerance: float = Field(0.15, gt=0, le=2, description="vertical miss (m) from which a point counts as unexplained")
    edge_cost: float = Field(0.15, ge=0, le=10, description="m² of unexplained roof that a metre of edge must save")
    step_cost: float = Field(0.2, ge=0, le=10, description="the same for a metre of edge per metre of step along it")
    step_limit: float = Field(0.3, gt=0, le=100, description="higher steps (m) cost no more than this one")
    near: float = Field(4.0, gt=0, le=100, description="surfaces with points nearer than this (m) may top a column")
    max_columns: int = Field(1500, ge=1, le=20_000, description="cutting ends at this number of columns")


@dataclass(frozen=True, slots=True)
class Columns:
    """A cut outline: `labels[cell]` is the surface on top of each cell of `division`."""

    division: Subdivision
    labels: dict[int, int]
    lines: list[CutLine]


class TopEnergy:
    """Cost of surfaces on columns, and of edges between columns."""

    def __init__(self, segments: PlaneSegments, parameters: ColumnParameters, area: float) -> None:
        self.points = np.ascontiguousarray(segments.points)
        self.planes = np.ascontiguousarray(segments.coefficients)
        self.labels = segments.labels
        self.tolerance = max(parameters.tolerance, 3 * segments.noise)
        self.area_of_point = area / max(len(segments.points), 1)
        self.parameters = parameters
        z = segments.points[:, 2]
        self.lowest, self.highest = float(z.min()) - 1.0, float(z.max()) + 1.0
        self.trees = [cKDTree(segments.points[segments.labels == k, :2]) for k in range(len(segments))]

    def costs(self, division: Subdivision, numbers: list[int]) -> tuple[FloatArray, IntArray]:
        """(C, P) cost (m²) of each surface on each column, and (C,) number of points in the column."""
        cell = points_in_cells(division, numbers, self.points[:, 0].copy(), self.points[:, 1].copy())
        cost = plane_costs(self.points, cell, self.planes, self.tolerance, len(numbers)) * self.area_of_point
        count = np.bincount(cell[cell >= 0], minlength=len(numbers))
        for k, number in enumerate(numbers):
            xy = np.array([division.xy[v] for v in division.cells[number][0]])
            z = xy @ self.planes[:, :2].T + self.planes[:, 2]
            wild = np.any((z < self.lowest) | (z > self.highest), axis=0)
            cost[k] += wild * division.area(number)
        return cost, count

    def allowed(self, division: Subdivision, numbers: list[int]) -> BoolArray:
        """(C, P) surfaces with points near the column; all where none has."""
        box = np.array([_bounds(division, number) for number in numbers])
        centre, half = (box[:, :2] + box[:, 2:]) / 2, np.hypot(*(box[:, 2:] - box[:, :2]).T) / 2
        near = np.zeros((len(numbers), len(self.planes)), bool)
        for p, tree in enumerate(self.trees):
            if tree.n:
                near[:, p] = tree.query(centre)[0] <= half + self.parameters.near
        near[~near.any(axis=1)] = True
        return near

    def minimise(self, division: Subdivision) -> dict[int, int]:
        """Surface on top of each column."""
        numbers = list(division.cells)
        cost, _ = self.costs(division, numbers)
        cost = np.where(self.allowed(division, numbers), cost, FORBIDDEN)
        pairs, ends = inner_edges(division, {number: k for k, number in enumerate(numbers)})
        z = ends @ self.planes[:, :2].T + self.planes[:, 2]
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        p = self.parameters
        weights = np.column_stack([p.edge_cost * length, p.step_cost * length])
        labels = label_columns(cost, pairs, z, weights, p.step_limit)
        return {number: int(label) for number, label in zip(numbers, labels, strict=True)}


def inner_edges(division: Subdivision, position: dict[int, int]) -> tuple[IntArray, FloatArray]:
    """(E, 2) positions of the columns on both sides of each inner edge, and (E, 2, 2) its ends."""
    inner = [(u, v) for u, v in division.left if u < v and (v, u) in division.left]
    if not inner:
        return np.empty((0, 2), np.int64), np.empty((0, 2, 2))
    pairs = np.array([[position[division.left[u, v]], position[division.left[v, u]]] for u, v in inner], np.int64)
    return pairs, np.array(division.xy)[np.array(inner)]


def cut_in_columns(
    outline: shapely.Polygon, segments: PlaneSegments, lines: list[CutLine], parameters: ColumnParameters
) -> Columns:
    """Columns of the outline and their tops; lines earlier in the list cut first.

    Parameters
    ----------
    outline : local frame
    segments : at least one surface, local frame
    """
    energy = TopEnergy(segments, parameters, outline.area)
    for _ in range(ROUNDS):
        division = Subdivision.of_polygon(outline)
        cut_all(division, lines, parameters.max_columns)
        labels = energy.minimise(division)
        used = line_use(division, labels, lines)
        asked = [parameters.min_length * (0.5 if line.is_crossing else 1.0) for line in lines]
        useful = [line for line, use, least in zip(lines, used, asked, strict=True) if use >= least]
        if len(useful) == len(lines):
            break
        lines = useful
    labels = division.merge(labels)
    labels = without_slivers(division, labels, energy, parameters.min_width)
    division.dissolve()
    return Columns(division, labels, lines)


def cut_all(division: Subdivision, lines: list[CutLine], most: int) -> None:
    """Cut every column that a line's stretch crosses; boxes tell which these are."""
    boxes = {number: _bounds(division, number) for number in division.cells}
    for line in lines:
        numbers = np.array(list(boxes))
        box = np.array([boxes[n] for n in numbers])
        centre, half = (box[:, :2] + box[:, 2:]) / 2, (box[:, 2:] - box[:, :2]) / 2
        across = np.abs(centre @ (line.nx, line.ny) - line.offset) - half @ (abs(line.nx), abs(line.ny))
        along = np.abs(centre @ (-line.ny, line.nx) - (line.start + line.end) / 2) - half @ (abs(line.ny), abs(line.nx))
        for number in numbers[(across < 0) & (along < (line.end - line.start) / 2)].tolist():
            if len(division.cells) >= most:
                return
            parts = division.cut(number, line)
            if parts != [number]:
                del boxes[number]
                boxes.update({part: _bounds(division, part) for part in parts})


def _bounds(division: Subdivision, number: int) -> tuple[float, float, float, float]:
    x, y = zip(*(division.xy[v] for v in division.cells[number][0]), strict=True)
    return min(x), min(y), max(x), max(y)


def without_slivers(division: Subdivision, labels: dict[int, int], energy: TopEnergy, width: float) -> dict[int, int]:
    """Labels after narrow columns have joined the neighbour that explains their points best, smallest first."""
    for _ in range(len(division.cells)):
        numbers = list(division.cells)
        narrow = [n for n in numbers if len(numbers) > 1 and _is_narrow(division, n, width)]
        move = _best_move(division, labels, energy, narrow) if narrow else None
        if move is None:
            break
        labels = division.merge({**labels, move[0]: move[1]})
    return labels


def _best_move(
    division: Subdivision, labels: dict[int, int], energy: TopEnergy, narrow: list[int]
) -> tuple[int, int] | None:
    cost, count = energy.costs(division, narrow)
    moves = []
    for k, number in enumerate(narrow):
        others = sorted({labels[n] for n in division.neighbours(number)} - {labels[number]})
        if not others:
            continue
        best = min(others, key=lambda label: cost[k, label])
        # Points demand a narrow polygon where most of ten or more would be left unexplained without it.
        if count[k] >= 10 and cost[k, best] - cost[k, labels[number]] > 0.6 * count[k] * energy.area_of_point:
            continue
        moves.append((division.area(number), number, best))
    return min(moves)[1:] if moves else None


def _is_narrow(division: Subdivision, number: int, width: float) -> bool:
    perimeter = sum(division.length(edge) for ring in division.cells[number] for edge in ring_edges(ring))
    if 2 * division.area(number) / perimeter >= width:
        return False
    return bool(shapely.is_empty(division.polygon(number).buffer(-width / 2)))
