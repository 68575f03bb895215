"""The outline cut in columns, and the surface that tops each (Frommholz 2017, section 3: the polygonal hull).

Every edge of the hull lies, in plan, on a line where two roofs meet, on a wall, or on a step between roofs. These lines cut
the outline in polygons; a column stands on each, and the surface on top of it is found for all columns together: points that
are left unexplained, and metres of edge and of step between columns, cost as little as possible. A hull made of columns
is closed whatever surfaces are chosen, which a hull put together from edges is not.

Only surfaces that have points near a column can top it, so that the minimum cuts stay small with a hundred surfaces.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray
from cityflow.geometry.cell_labels import label_cells
from cityflow.reconstruction.partition.plane_energy import PartitionParameters, PlaneEnergy
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.planes.plane_segments import PlaneSegments

FORBIDDEN = 1e6
"""Cost (m²) of a surface that must not top a column."""


class ColumnParameters(PartitionParameters):
    """How an outline is cut in columns, and what an edge must be worth."""

    near: float = Field(4.0, gt=0, le=100, description="surfaces with points nearer than this (m) may top a column")
    number_cost: float = Field(
        1.2, ge=0, le=100, description="a polygon needs so many explained points for each of its parameters"
    )
    alike_m: float = Field(0.0, ge=0, le=5, description="points nearer to each other than this (m) have a common error")
    max_lines: int = Field(400, ge=1, le=5000, description="most lines that cut the outline")
    max_cells: int = Field(1500, ge=1, le=20_000, description="cutting ends at this number of columns")


class TopEnergy(PlaneEnergy):
    """Cost of surfaces on columns, and of edges between columns; only surfaces near a column may top it."""

    def __init__(self, segments: PlaneSegments, parameters: ColumnParameters, area: float) -> None:
        super().__init__(segments, parameters, area)
        self.near = parameters.near
        self.trees = [cKDTree(segments.points[segments.labels == k, :2]) for k in range(len(segments))]

    def allowed(self, division: Subdivision, numbers: list[int]) -> BoolArray:
        """(C, P) surfaces with points near the column; all where none has."""
        rings = [np.array([division.xy[v] for v in division.cells[number][0]]) for number in numbers]
        low, high = (np.array([edge(ring, axis=0) for ring in rings]) for edge in (np.min, np.max))
        near = np.zeros((len(numbers), len(self.planes)), bool)
        for p, tree in enumerate(self.trees):
            if tree.n:
                near[:, p] = tree.query((low + high) / 2)[0] <= np.hypot(*(high - low).T) / 2 + self.near
        near[~near.any(axis=1)] = True
        return near

    def minimise(self, division: Subdivision) -> dict[int, int]:
        """Surface on top of each column."""
        numbers = list(division.cells)
        cost, _ = self.costs(division, numbers)
        cost = np.where(self.allowed(division, numbers), cost, FORBIDDEN)
        labels = label_cells(cost, self._borders(division))
        return {number: int(label) for number, label in zip(numbers, labels, strict=True)}
