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
