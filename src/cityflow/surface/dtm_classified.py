"""Terrain from points classified as ground: local planes, and a triangulation under buildings.

Wrong classes are met twice: where few of a neighbourhood's points are called ground and those do not continue the
ground around them, they are dropped; and so are points that lie off the local median.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field
from scipy.ndimage import median_filter

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import GROUND, WATER, PointCloud
from cityflow.surface.dtm_morphological import MorphologicalParameters, objects_by_opening
from cityflow.surface.gridding import bridge_gaps, plane_heights, terrain_from_points
from cityflow.surface.ground_points import slope_of, work_grid
from cityflow.surface.rasterise import count_points, sums_around
from cityflow.surface.sample import sample

GROUND_SHARE = 0.5
"""Where fewer of a neighbourhood's points are ground, ground must continue its surroundings: the majority of them."""
OUTLIER_M = 0.35
"""A point this far off the local median is no ground, metres; set by hand on synthetic scenes."""


class ClassifiedParameters(Parameters):
    """How far a classified cloud is believed."""

    largest_window_m: float = Field(
        60.0, ge=5, le=300, description="wider than the narrow side of any building, metres"
    )

    @property
    def halo_m(self) -> float:
        """Reach of the largest window, and of the gap that the largest building leaves."""
        return self.largest_window_m + 10.0


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: ClassifiedParameters) -> FloatArray:
    """(rows, cols) terrain at the cell centres of `grid`, metres; NaN throughout where no point is ground.

    Points on water count as ground: the water's surface is the terrain there. `dsm` is not needed.
    """
    del dsm
    ground = points.of_class(GROUND, WATER)
    if len(ground) == 0:
        return np.full(grid.shape, np.nan)
    xyz = without_wrong_classes(points, ground, work_grid(grid), parameters)
    return terrain_from_points(xyz, grid)


def without_wrong_classes(points: PointCloud, ground: PointCloud, work: Grid, p: ClassifiedParameters) -> FloatArray:
    """(n, 3) ground points without those whose class is not credible."""
    doubtful = _doubtful_cells(points, ground, work, p)
    row, col = work.indices(ground.xyz[:, 0], ground.xyz[:, 1])
    inside = (row >= 0) & (row < work.rows) & (col >= 0) & (col < work.cols)
    keep = inside.copy()
    keep[inside] = ~doubtful[row[inside], col[inside]]
    xyz = ground.xyz[keep] if keep.any() else ground.xyz[inside]
    middle = median_filter(bridge_gaps(plane_heights(xyz, work, half=0), work), 5, mode="nearest")
    height = sample(work, middle, xyz[:, 0], xyz[:, 1])
    slope = sample(work, slope_of(middle, work.cell), xyz[:, 0], xyz[:, 1])
    near = np.abs(xyz[:, 2] - height) <= OUTLIER_M + 1.5 * np.minimum(slope, 1.5)
    return np.asarray(xyz[near] if near.any() else xyz)


def _doubtful_cells(points: PointCloud, ground: PointCloud, work: Grid, p: ClassifiedParameters) -> BoolArray:
    """Cells where ground is rare among the last returns and does not continue the ground around."""
    last = points.take(points.return_number >= points.number_of_returns)
    of_ground, of_all = (count_points(c, work) for c in (ground, last))
    around = [sums_around(n, 3, "nearest") for n in (of_ground, of_all)]
    # The rim of a roof has ground in its neighbourhood, but not in its own cell.
    rare = (around[0] < GROUND_SHARE * around[1]) | (of_ground < GROUND_SHARE * of_all)
    if not rare.any():
        return np.zeros(work.shape, bool)
    height = bridge_gaps(plane_heights(ground.xyz, work, half=0), work)
    raised = objects_by_opening(height, MorphologicalParameters(largest_window_m=p.largest_window_m))
    return np.asarray(rare & (raised > 0))
