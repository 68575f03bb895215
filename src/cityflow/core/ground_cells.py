"""Ground cells that belong to a reference image: cells of a lattice independent of tiles, cut to a ground tile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Bounds


@dataclass(frozen=True, slots=True)
class GroundCells:
    """Chosen cells of a lattice counted from the CRS origin, and the ground tile that they are cut to.

    Attributes
    ----------
    tile : bounds of the ground tile, metres
    cell_m : edge of a lattice cell
    chosen : (col, row) of the cells, sorted; each meets the tile
    """

    tile: Bounds
    cell_m: float
    chosen: tuple[tuple[int, int], ...]

    @property
    def bounds(self) -> Bounds:
        """Box around the chosen cells, cut to the tile. Raises ValueError where no cell is chosen."""
        if not self.chosen:
            raise ValueError("no cell is chosen")
        cols, rows = zip(*self.chosen, strict=True)
        x_min, y_min, x_max, y_max = self.tile
        return (
            max(x_min, min(cols) * self.cell_m), max(y_min, min(rows) * self.cell_m),
            min(x_max, (max(cols) + 1) * self.cell_m), min(y_max, (max(rows) + 1) * self.cell_m),
        )  # fmt: skip

    def holds(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Which points stand in a chosen cell and in the tile; half-open, so that every point has one owner.

        >>> cells = GroundCells((0.0, 0.0, 30.0, 30.0), 20.0, ((0, 0), (1, 0)))
        >>> cells.holds(np.array([5.0, 25.0, 35.0]), np.array([5.0, 5.0, 5.0])).tolist()
        [True, True, False]
        """
        x_min, y_min, x_max, y_max = self.tile
        if not self.chosen:
            return np.zeros(np.shape(x), bool)
        cols, rows = np.array(self.chosen, np.int64).T
        col_0, row_0 = int(cols.min()), int(rows.min())
        table = np.zeros((int(rows.max()) - row_0 + 1, int(cols.max()) - col_0 + 1), bool)
        table[rows - row_0, cols - col_0] = True
        col = np.floor(x / self.cell_m).astype(np.int64) - col_0
        row = np.floor(y / self.cell_m).astype(np.int64) - row_0
        inside = (row >= 0) & (row < table.shape[0]) & (col >= 0) & (col < table.shape[1])
        inside &= (x >= x_min) & (x < x_max) & (y >= y_min) & (y < y_max)
        inside[inside] = table[row[inside], col[inside]]
        return np.asarray(inside)

    def meets(self, boxes: FloatArray, margin: float) -> BoolArray:
        """(N,) which of (N, 4) boxes (x_min, y_min, x_max, y_max), widened by a margin, meet the tile and a chosen cell; none with NaN does.

        >>> cells = GroundCells((0.0, 0.0, 30.0, 30.0), 20.0, ((0, 0), (1, 0)))
        >>> cells.meets(np.array([[21.0, 21.0, 22.0, 22.0], [32.0, 5.0, 40.0, 9.0]]), 1.0).tolist()
        [True, False]
        """
        x_0, y_0, x_1, y_1 = (boxes + np.array([-margin, -margin, margin, margin])).T
        x_min, y_min, x_max, y_max = self.tile
        found = (x_1 >= x_min) & (y_1 >= y_min) & (x_0 <= x_max) & (y_0 <= y_max)
        if not self.chosen or not found.any():
            return np.zeros(len(boxes), bool)
        cols, rows = np.array(self.chosen, np.int64).T
        col_0, row_0 = int(cols.min()), int(rows.min())
        count = np.zeros((int(rows.max()) - row_0 + 2, int(cols.max()) - col_0 + 2), np.int64)
        count[rows - row_0 + 1, cols - col_0 + 1] = 1
        count = count.cumsum(axis=0).cumsum(axis=1)
        # cells from the first that ends at the box or beyond to the last that begins before it ends
        first_col, first_row = (np.ceil(v[found] / self.cell_m) - 1 for v in (x_0, y_0))
        end_col, end_row = (np.floor(v[found] / self.cell_m) + 1 for v in (x_1, y_1))
        left, right = (np.clip(v - col_0, 0, count.shape[1] - 1).astype(np.int64) for v in (first_col, end_col))
        top, bottom = (np.clip(v - row_0, 0, count.shape[0] - 1).astype(np.int64) for v in (first_row, end_row))
        found[found] = count[bottom, right] - count[top, right] - count[bottom, left] + count[top, left] > 0
        return np.asarray(found)
