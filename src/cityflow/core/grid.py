"""Raster grids, and the lattice of ground tiles that cuts the world into units of work."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray

Bounds = tuple[float, float, float, float]
"""x_min, y_min, x_max, y_max in metres."""

Box = tuple[float, float, float, float, float, float]
"""x_min, y_min, z_min, x_max, y_max, z_max in metres."""

FARTHEST_TILE = 1_000_000
"""Tiles of the lattice to each side of the CRS origin: of 50 m, the smallest, they reach farther than any projected coordinate."""


@dataclass(frozen=True, slots=True)
class Grid:
    """A north-up raster of square cells; row 0 is the northernmost, (0, 0) its upper left cell.

    Attributes
    ----------
    x_min, y_max : float
        World coordinates of the outer corner of cell (0, 0), metres.
    cell : float
        Edge of a cell, metres.
    rows, cols : int
    """

    x_min: float
    y_max: float
    cell: float
    rows: int
    cols: int

    @classmethod
    def covering(cls, bounds: Bounds, cell: float) -> Grid:
        """Smallest grid over `bounds` whose cell edges are multiples of `cell` in the world.

        >>> Grid.covering((0.2, 0.0, 1.9, 1.0), 0.5)
        Grid(x_min=0.0, y_max=1.0, cell=0.5, rows=2, cols=4)
        """
        col_0, row_0 = math.floor(bounds[0] / cell + 1e-9), math.ceil(bounds[3] / cell - 1e-9)
        cols = math.ceil(bounds[2] / cell - 1e-9) - col_0
        rows = row_0 - math.floor(bounds[1] / cell + 1e-9)
        return cls(col_0 * cell, row_0 * cell, cell, max(rows, 1), max(cols, 1))

    @property
    def shape(self) -> tuple[int, int]:
        return self.rows, self.cols

    @property
    def bounds(self) -> Bounds:
        return self.x_min, self.y_max - self.rows * self.cell, self.x_min + self.cols * self.cell, self.y_max

    @property
    def transform(self) -> tuple[float, float, float, float, float, float]:
        """Affine coefficients a, b, c, d, e, f as rasterio's `Affine` takes them."""
        return self.cell, 0.0, self.x_min, 0.0, -self.cell, self.y_max

    def x_centres(self) -> FloatArray:
        return np.asarray(self.x_min + (np.arange(self.cols) + 0.5) * self.cell, np.float64)

    def y_centres(self) -> FloatArray:
        """Decreasing: row 0 is the northernmost."""
        return np.asarray(self.y_max - (np.arange(self.rows) + 0.5) * self.cell, np.float64)

    def centres(self) -> tuple[FloatArray, FloatArray]:
        """x and y of every cell's centre, (rows, cols) each.

        >>> Grid(0.0, 2.0, 1.0, 2, 2).centres()[1].tolist()
        [[1.5, 1.5], [0.5, 0.5]]
        """
        x, y = np.meshgrid(self.x_centres(), self.y_centres())
        return x, y

    def points(self, heights: FloatArray) -> FloatArray:
        """(N, 3) centres of the cells whose height (rows, cols) is finite, row after row, at that height."""
        x, y = self.centres()
        known = np.isfinite(heights)
        return np.column_stack([x[known], y[known], heights[known]])

    def indices(self, x: FloatArray, y: FloatArray) -> tuple[IntArray, IntArray]:
        """Row and column of each point; may lie outside the grid."""
        return (
            np.floor((self.y_max - y) / self.cell).astype(np.int64),
            np.floor((x - self.x_min) / self.cell).astype(np.int64),
        )

    def slices(self, part: Grid) -> tuple[slice, slice]:
        """Row and column slices of `part` (same cell, same alignment, inside this grid)."""
        row = round((self.y_max - part.y_max) / self.cell)
        col = round((part.x_min - self.x_min) / self.cell)
        if row < 0 or col < 0 or row + part.rows > self.rows or col + part.cols > self.cols:
            raise ValueError(f"{part} does not lie inside {self}")
        return slice(row, row + part.rows), slice(col, col + part.cols)

    def part_over(self, bounds: Bounds, step: int = 1) -> Grid | None:
        """The cells that bounds touch, and those beside them in squares of `step` cells counted from the corner; None where they touch none.

        Where squares do not divide the grid, all of it.

        >>> Grid(0.0, 4.0, 1.0, 4, 8).part_over((2.5, 0.5, 3.5, 9.0), 2)
        Grid(x_min=2.0, y_max=4.0, cell=1.0, rows=4, cols=2)
        >>> Grid(0.0, 4.0, 1.0, 4, 8).part_over((8.5, 0.5, 9.5, 1.0)) is None
        True
        """
        touched = Grid.covering(bounds, self.cell)
        top = max(round((self.y_max - touched.y_max) / self.cell), 0)
        left = max(round((touched.x_min - self.x_min) / self.cell), 0)
        bottom = min(round((self.y_max - touched.y_max) / self.cell) + touched.rows, self.rows)
        right = min(round((touched.x_min - self.x_min) / self.cell) + touched.cols, self.cols)
        if top >= bottom or left >= right:
            return None
        if self.rows % step or self.cols % step:
            return self
        top, left, bottom, right = (
            top // step * step,
            left // step * step,
            -(-bottom // step) * step,
            -(-right // step) * step,
        )
        return Grid(self.x_min + left * self.cell, self.y_max - top * self.cell, self.cell, bottom - top, right - left)


@dataclass(frozen=True, slots=True, order=True)
class Tile:
    """One square of the ground-tile lattice: column and row count eastwards and northwards from the CRS origin."""

    col: int
    row: int
    size: float

    @property
    def name(self) -> str:
        """Stable name, the same for any extent of the survey: lattice column and row."""
        return f"{self.col}_{self.row}"

    @property
    def bounds(self) -> Bounds:
        return self.col * self.size, self.row * self.size, (self.col + 1) * self.size, (self.row + 1) * self.size

    def buffered(self, halo: float) -> Bounds:
        x_min, y_min, x_max, y_max = self.bounds
        return x_min - halo, y_min - halo, x_max + halo, y_max + halo

    def owns(self, x: float, y: float) -> bool:
        """Half-open: a point on a shared edge belongs to the tile east or north of it."""
        return math.floor(x / self.size) == self.col and math.floor(y / self.size) == self.row


def tile_at(x: float, y: float, size: float) -> Tile:
    """The tile that owns a point.

    >>> tile_at(85000.0, 447500.0, 250.0).name
    '340_1790'
    """
    return Tile(math.floor(x / size), math.floor(y / size), size)


def tiles_over(bounds: Bounds, size: float) -> Iterator[Tile]:
    """Tiles that meet `bounds` with more than an edge, in row-major order from the south-west."""
    col_0, row_0 = math.floor(bounds[0] / size), math.floor(bounds[1] / size)
    col_1, row_1 = max(math.ceil(bounds[2] / size), col_0 + 1), max(math.ceil(bounds[3] / size), row_0 + 1)
    for row in range(row_0, row_1):
        for col in range(col_0, col_1):
            yield Tile(col, row, size)


def tile_names_over(bounds: Bounds, size: float) -> list[str]:
    """Their names.

    >>> tile_names_over((10.0, 20.0, 260.0, 30.0), 250.0)
    ['0_0', '1_0']
    """
    col_0, row_0 = math.floor(bounds[0] / size), math.floor(bounds[1] / size)
    col_1, row_1 = max(math.ceil(bounds[2] / size), col_0 + 1), max(math.ceil(bounds[3] / size), row_0 + 1)
    return [f"{col}_{row}" for row in range(row_0, row_1) for col in range(col_0, col_1)]


def grid_over(tiles: Iterable[Tile], cell_m: float) -> Grid:
    """The grid over whole tiles."""
    boxes = [t.bounds for t in tiles]
    low, high = [min(b[i] for b in boxes) for i in (0, 1)], [max(b[i] for b in boxes) for i in (2, 3)]
    return Grid.covering((low[0], low[1], high[0], high[1]), cell_m)


def lattice_grid(tile_m: float, cell_m: float) -> Grid:
    """The grid over every tile that there can be: where a cell or a tile stands in it depends on no survey.

    >>> lattice_grid(250.0, 0.5).slices(Grid(0.0, 250.0, 0.5, 500, 500))[1].start // 500
    1000000
    """
    edge = 2 * FARTHEST_TILE * round(tile_m / cell_m)
    return Grid(-FARTHEST_TILE * tile_m, FARTHEST_TILE * tile_m, cell_m, edge, edge)


def bounds_around(first: Bounds, second: Bounds) -> Bounds:
    """The box around two.

    >>> bounds_around((0.0, 0.0, 2.0, 1.0), (1.0, -3.0, 1.5, 0.5))
    (0.0, -3.0, 2.0, 1.0)
    """
    return min(first[0], second[0]), min(first[1], second[1]), max(first[2], second[2]), max(first[3], second[3])


def grown(bounds: Bounds, by: float) -> Bounds:
    """A box with `by` metres more on every side.

    >>> grown((0.0, 0.0, 2.0, 1.0), 0.5)
    (-0.5, -0.5, 2.5, 1.5)
    """
    return bounds[0] - by, bounds[1] - by, bounds[2] + by, bounds[3] + by


def bounds_meet(a: Bounds, b: Bounds) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
