"""Costs of planes in the cells of a plan (unexplained roof, edges, steps), and the planes of minimum cost."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.geometry.cell_labels import Borders, label_cells
from cityflow.reconstruction.partition.cell_evidence import edges_of_cells, plane_costs, points_in_cells, wild_areas
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.simplification import PLANE_NUMBERS
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.solids.ring_tracing import Edge


class PartitionParameters(Parameters):
    """How an outline is cut, and what an edge must be worth."""

    reach: float = Field(1.0, gt=0, le=5, description="segments nearer than this (m) are neighbours")
    gap: float = Field(
        4.0, gt=0, le=50, description="segments nearer than this (m) are neighbours across areas without planes"
    )
    min_length: float = Field(0.7, gt=0, le=10, description="shortest line (m) along which the outline is cut")
    min_width: float = Field(
        0.6, ge=0, le=5, description="narrower roof polygons (m) are removed unless points support them"
    )
    tolerance: float = Field(0.15, gt=0, le=2, description="vertical miss (m) from which a point counts as unexplained")
    edge_cost: float = Field(0.15, ge=0, le=10, description="m² of unexplained roof that a metre of edge must save")
    step_cost: float = Field(
        0.2,
        ge=0,
        le=10,
        description="further m² that a metre of edge must save, for each metre of height step along it",
    )
    step_limit: float = Field(0.3, gt=0, le=100, description="steps higher than this (m) cost no more")
    number_cost: float = Field(
        0.6,
        ge=0,
        le=100,
        description="a polygon needs so many explained independent points for each of its parameters",
    )
    alike_m: float = Field(
        0.3,
        ge=0,
        le=5,
        description="points nearer to each other than this (m) have a common error and count as one independent point",
    )
    max_lines: int = Field(80, ge=1, le=1000, description="most lines considered for one outline")
    max_cells: int = Field(200, ge=1, le=5000, description="cutting ends at this number of cells")


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
        return cost + wild_areas(*edges_of_cells(division, numbers), self.planes, self.lowest, self.highest), count

    def minimise(self, division: Subdivision) -> dict[int, int]:
        """Plane of each cell."""
        numbers = list(division.cells)
        cost, _ = self.costs(division, numbers)
        labels = label_cells(cost, self._borders(division), try_one_for_all=True)
        return {number: int(label) for number, label in zip(numbers, labels, strict=True)}

    def _borders(self, division: Subdivision) -> Borders:
        """Where cells meet, with what the planes cost there (m²)."""
        cells, ends = inner_edges(division)
        length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        p = self.parameters
        z = ends @ self.planes[:, :2].T + self.planes[:, 2]
        return Borders(cells, z, p.edge_cost * length, p.step_cost * length, p.step_limit)

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


def inner_edges(division: Subdivision) -> tuple[IntArray, FloatArray]:
    """(E, 2) positions of the cells on both sides of each inner edge, among all cells, and (E, 2, 2) its ends."""
    inner = [(u, v) for u, v in division.left if u < v and (v, u) in division.left]
    if not inner:
        return np.empty((0, 2), np.int64), np.empty((0, 2, 2))
    position = {number: k for k, number in enumerate(division.cells)}
    cells = np.array([[position[division.left[u, v]], position[division.left[v, u]]] for u, v in inner], np.int64)
    return cells, np.array(division.xy)[np.array(inner)]
