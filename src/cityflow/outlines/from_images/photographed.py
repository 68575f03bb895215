"""Roofs and the images that show them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import Float32Array
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid


@dataclass(frozen=True, slots=True)
class Photographed:
    """A surface as fine as it was matched, read where it is asked for, and images of it.

    Attributes
    ----------
    images : all that have a region of the surface in their frame, in the same order whatever else they hold
    surface : bounds, metres → (rows, cols) heights without holes on a grid that covers them, metres; NaN where unknown
    """

    images: Sequence[ColourImage]
    surface: Callable[[Bounds], tuple[Grid, Float32Array]]

    def heights(self, grid: Grid) -> Float32Array:
        """(rows, cols) heights at the cells of a grid: means of four places in each."""
        fine, heights = self.surface(grid.bounds)
        x, y = grid.centres()
        total, off = np.zeros(grid.shape, np.float64), grid.cell / 4.0
        for dx, dy in ((-off, -off), (-off, off), (off, -off), (off, off)):
            row, col = fine.indices(x + dx, y + dy)
            on = (row >= 0) & (col >= 0) & (row < fine.rows) & (col < fine.cols)
            total += np.where(on, heights[np.clip(row, 0, fine.rows - 1), np.clip(col, 0, fine.cols - 1)], np.nan)
        return (total / 4.0).astype(np.float32)
