"""Block models from a roof partition: one block (LoD1.2), or one per part of the roof that a height jump sets apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Lod, Polyhedron
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.assemble import MIN_HEIGHT, assemble


class LevelParameters(Parameters):
    """Heights of blocks, and what sets two blocks apart."""

    percentile: float = Field(70.0, ge=0, le=100, description="percentile of the roof's heights that is a block's top")
    jump: float = Field(3.0, gt=0, le=100, description="least mean height step (m) along an edge between two blocks")
    min_area_m2: float = Field(4.0, ge=0, le=1000, description="smaller blocks join their highest neighbour")


class BlockLevels(Mapping[Lod, Polyhedron]):
    """Blocks that are made when somebody looks at them: models that are only compared need none.

    Parameters
    ----------
    make : makes them all
    parameters : by which
    """

    LODS = (Lod.LOD12, Lod.LOD13)

    def __init__(self, make: Callable[[LevelParameters], dict[Lod, Polyhedron]], parameters: LevelParameters) -> None:
        self._make, self._parameters = make, parameters

    def by(self, parameters: LevelParameters) -> BlockLevels:
        """The same blocks by other parameters."""
        return BlockLevels(self._make, parameters)

    @cached_property
    def _made(self) -> dict[Lod, Polyhedron]:
        return self._make(self._parameters)

    def __getitem__(self, lod: Lod) -> Polyhedron:
        return self._made[lod]

    def __iter__(self) -> Iterator[Lod]:
        return iter(self.LODS)

    def __len__(self) -> int:
        return len(self.LODS)


def block_levels(
    partition: RoofPartition,
    coefficients: FloatArray,
    floor: float,
    origin: tuple[float, float, float],
    outline: Polygon,
) -> BlockLevels:
    """LoD1.2 and LoD1.3 of a unit, from its LoD2.2 partition (arguments as of `assemble`), by the usual parameters."""
    return BlockLevels(partial(_made, partition, coefficients, floor, origin, outline), LevelParameters())


def _made(
    partition: RoofPartition,
    coefficients: FloatArray,
    floor: float,
    origin: tuple[float, float, float],
    outline: Polygon,
    parameters: LevelParameters,
) -> dict[Lod, Polyhedron]:
    division, planes = partition.subdivision()
    heights = {cell: _heights(division, cell, coefficients[plane]) for cell, plane in planes.items()}
    every = np.concatenate(list(heights.values()))
    top = float(np.percentile(every, parameters.percentile)) + origin[2]
    blocks = _joined_across_small_steps(division, planes, coefficients, parameters.jump)
    blocks = _without_small_blocks(division, blocks, parameters.min_area_m2)
    return {
        Lod.LOD12: extrude(outline, floor, max(top, floor + MIN_HEIGHT)),
        Lod.LOD13: _stepped(division, blocks, heights, parameters.percentile, floor, origin, outline),
    }


def _heights(division: Subdivision, cell: int, plane: FloatArray, spacing: float = 0.5) -> FloatArray:
    """Heights of the roof over a cell on a lattice, at least at its middle."""
    polygon = division.polygon(cell)
    x0, y0, x1, y1 = polygon.bounds
    step = max(spacing, float(np.sqrt(polygon.area / 400)))
    x, y = (g.ravel() for g in np.meshgrid(np.arange(x0 + step / 2, x1, step), np.arange(y0 + step / 2, y1, step)))
    inside = shapely.contains_xy(polygon, x, y)
    if not inside.any():
        middle = polygon.representative_point()
        x, y, inside = np.array([middle.x]), np.array([middle.y]), np.array([True])
    return np.asarray(plane[0] * x[inside] + plane[1] * y[inside] + plane[2])


def _joined_across_small_steps(
    division: Subdivision, planes: dict[int, int], coefficients: FloatArray, jump: float
) -> dict[int, int]:
    """Block number of each cell: cells join across any edge whose mean step is below the jump."""
    leader = {cell: cell for cell in division.cells}

    def root(cell: int) -> int:
        while leader[cell] != cell:
            cell = leader[cell]
        return cell

    for (u, v), left in sorted(division.left.items()):
        right = division.left.get((v, u))
        if right is None or u > v:
            continue
        a, b, c = coefficients[planes[left]] - coefficients[planes[right]]
        steps = [a * division.xy[w][0] + b * division.xy[w][1] + c for w in (u, v)]
        if np.mean(np.abs(steps)) < jump:
            first, second = root(left), root(right)
            leader[max(first, second)] = min(first, second)
    return {cell: root(cell) for cell in division.cells}


def _without_small_blocks(division: Subdivision, blocks: dict[int, int], min_area: float) -> dict[int, int]:
    """Blocks after each one too small has joined the neighbour with the longest common border."""
    while len(set(blocks.values())) > 1:
        area: dict[int, float] = {}
        for cell, block in blocks.items():
            area[block] = area.get(block, 0.0) + division.area(cell)
        smallest = min(sorted(area), key=lambda block: area[block])
        if area[smallest] >= min_area:
            break
        border: dict[int, float] = {}
        for (u, v), left in sorted(division.left.items()):
            other = blocks.get(division.left.get((v, u), -1), smallest)
            if blocks[left] == smallest and other != smallest:
                border[other] = border.get(other, 0.0) + division.length((u, v))
        if not border:
            break
        joins = max(sorted(border), key=lambda block: border[block])
        blocks = {cell: joins if block == smallest else block for cell, block in blocks.items()}
    return blocks


def _stepped(
    division: Subdivision,
    blocks: dict[int, int],
    heights: dict[int, FloatArray],
    percentile: float,
    floor: float,
    origin: tuple[float, float, float],
    outline: Polygon,
) -> Polyhedron:
    numbers = sorted(set(blocks.values()))
    tops = []
    for number in numbers:
        every = np.concatenate([heights[cell] for cell, block in blocks.items() if block == number])
        tops.append(max(float(np.percentile(every, percentile)), floor - origin[2] + MIN_HEIGHT))
    labels = division.merge({cell: numbers.index(block) for cell, block in blocks.items()})
    division.dissolve()
    coefficients = np.column_stack([np.zeros(len(tops)), np.zeros(len(tops)), tops])
    return assemble(RoofPartition.of_subdivision(division, labels), coefficients, floor, origin, outline)
