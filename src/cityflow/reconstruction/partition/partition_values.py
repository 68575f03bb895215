"""A finished partition of an outline: shared vertices, cells, and the plane of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.partition.subdivision import Subdivision


@dataclass(frozen=True, slots=True)
class RoofCell:
    """Exterior ring (counter-clockwise) and holes (clockwise) as vertex indices, and the index of the cell's plane."""

    rings: tuple[tuple[int, ...], ...]
    plane: int


@dataclass(frozen=True, slots=True)
class RoofPartition:
    """Cells that cover an outline without gap or overlap; vertices on a common edge belong to both cells.

    Attributes
    ----------
    vertices : (V, 2) float64, local metres
    outline_vertices : the first so many vertices are the outline's own, ring by ring in its order
    cells : tuple of RoofCell
    """

    vertices: FloatArray
    outline_vertices: int
    cells: tuple[RoofCell, ...]

    @classmethod
    def of_subdivision(cls, division: Subdivision, labels: dict[int, int]) -> RoofPartition:
        """Freeze a subdivision; vertices that no cell uses any more are left out."""
        in_rings = {v for rings in division.cells.values() for ring in rings for v in ring}
        used = sorted(in_rings | set(range(division.fixed)))
        index = {v: k for k, v in enumerate(used)}
        cells = tuple(
            RoofCell(tuple(tuple(index[v] for v in ring) for ring in rings), labels[number])
            for number, rings in sorted(division.cells.items())
        )
        return cls(np.array([division.xy[v] for v in used]), division.fixed, cells)

    def subdivision(self) -> tuple[Subdivision, dict[int, int]]:
        """A copy to change, and the planes of its cells."""
        division = Subdivision()
        division.xy = [(float(x), float(y)) for x, y in self.vertices]
        division.fixed = self.outline_vertices
        labels = {division.add([list(ring) for ring in cell.rings]): cell.plane for cell in self.cells}
        return division, labels

    def renumbered(self, used: Sequence[int]) -> RoofPartition:
        """The same cells, with the positions of their planes in `used`."""
        number = {plane: k for k, plane in enumerate(used)}
        return replace(self, cells=tuple(replace(cell, plane=number[cell.plane]) for cell in self.cells))

    def polygon(self, cell: RoofCell) -> Polygon:
        shell, *holes = (self.vertices[list(ring)] for ring in cell.rings)
        return Polygon(shell, holes)


def single_cell(outline: Polygon, plane: int = 0) -> RoofPartition:
    """The outline as one cell."""
    division = Subdivision.of_polygon(outline)
    return RoofPartition.of_subdivision(division, dict.fromkeys(division.cells, plane))
