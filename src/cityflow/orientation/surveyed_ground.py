"""How many images see a place that is matched, and which ground is looked down on: there a survey has been, however it is cut into tiles.

What counts is the flight plan: the reference image that answers for a place, and those of its partners that have the place in their frame. A height that two
images give is checked by the third. Beyond the ground that enough of them see, heights are few, and nothing says which of them are wrong; so they are where
slanting images alone look, far out and past everything that stands before it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Grid
from cityflow.core.ground_cells import GroundCells
from cityflow.orientation.views import View, footprints, sees, sees_each

MOST_TILT = np.radians(40.0)
"""Images look down on the ground that look no flatter than this; set by hand, as are those below."""

BEYOND_M = 10.0
"""A survey ends this far beyond the ground that such images see."""


@dataclass(frozen=True, slots=True)
class MatchedGround:
    """A reference image, the images that it is matched with, and the ground that it answers for."""

    base: OrientedImage
    partners: tuple[OrientedImage, ...]
    cells: GroundCells


def images_of_ground(matched: Iterable[MatchedGround], grid: Grid, heights: FloatArray) -> IntArray:
    """(rows, cols) for each cell the most images, a base and its partners, that have it in their frames; 0 where it is not matched.

    Parameters
    ----------
    matched : in any order
    heights : (rows, cols) of the ground at the cells' centres, world metres
    """
    most = np.zeros(grid.shape, np.int64)
    for one in matched:
        rows, cols = _window(grid, one.cells)
        x, y = np.meshgrid(grid.x_centres()[cols], grid.y_centres()[rows])
        row, col = np.nonzero(one.cells.holds(x.ravel(), y.ravel()).reshape(x.shape))
        xyz = np.column_stack([x[row, col], y[row, col], heights[rows, cols][row, col]])
        others = sees_each(one.partners, xyz).sum(axis=0, dtype=np.int64)
        count = np.where(sees(one.base, xyz) & (others > 0), 1 + others, 0)
        np.maximum.at(most, (row + rows.start, col + cols.start), count)
    return most


def looked_down_on(views: Sequence[View]) -> BaseGeometry:
    """Ground, world metres, within `BEYOND_M` of what the views see that look down steeply; of what all see where no two of them do."""
    steep = [v for v in views if v.image.tilt <= MOST_TILT]
    ground = shapely.union_all(footprints(steep if len(steep) > 1 else views)).buffer(BEYOND_M)
    shapely.prepare(ground)
    return ground


def _window(grid: Grid, cells: GroundCells) -> tuple[slice, slice]:
    """Rows and columns of the grid that may have their centres in the cells; empty where there are none."""
    x_min, y_min, x_max, y_max = cells.bounds
    first_col, last_col = (int(np.floor((x - grid.x_min) / grid.cell)) for x in (x_min, x_max))
    first_row, last_row = (int(np.floor((grid.y_max - y) / grid.cell)) for y in (y_max, y_min))
    return (
        slice(max(first_row, 0), max(min(last_row + 1, grid.rows), max(first_row, 0))),
        slice(max(first_col, 0), max(min(last_col + 1, grid.cols), max(first_col, 0))),
    )
