"""Coverage of a flight before matching: views, directions, walls, resolution and angles per ground cell.

Heights are one surface (terrain, or a level): what hides behind houses is not known yet, so these maps are the best that can be hoped for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from cityflow.core.arrays import Float32Array, FloatArray, IntArray
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.orientation.look_directions import COMPASS
from cityflow.orientation.views import View, footprint, sees

STEEPEST_INCIDENCE_DEG = 65.0
"""A wall seen at a flatter angle gives neither points nor texture; set by hand."""
PAIRS_AT_ONCE = 2000
"""Footprints whose neighbours are looked up at once; all together would take too much memory."""
WALL_NORMALS = np.array([[np.sin(a), np.cos(a)] for a in np.radians(np.arange(8) * 45.0)])
"""(8, 2) outward normals of walls that face north, northeast, … as in `COMPASS`."""
SPREAD_AXES = np.array(
    [[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)], np.float64
)
SPREAD_AXES /= np.linalg.norm(SPREAD_AXES, axis=1, keepdims=True)
"""(13, 3) axes along which the spread of rays is kept: enough to know the largest angle to within a tenth."""


@dataclass(frozen=True)
class Coverage:
    """Maps of a flight on a ground grid; 0 or NaN where nothing is seen.

    Attributes
    ----------
    grid : cells of the maps
    views : (rows, cols) int64, images that see the cell
    by_direction : name of a look direction → (rows, cols) int64, its images
    walls : (8, rows, cols) int64, images that see a wall facing north, northeast, … (`COMPASS`) at less than 65° from its normal
    gsd : (rows, cols) float32, finest pixel on the ground across the ray, metres
    angle_deg : (rows, cols) float32, about the largest angle between two rays, degrees
    alone : images whose footprint no other image meets, sorted
    """

    grid: Grid
    views: IntArray
    by_direction: Mapping[str, IntArray]
    walls: IntArray
    gsd: Float32Array
    angle_deg: Float32Array
    alone: tuple[str, ...]


def coverage(
    views: Sequence[View], frames: Sequence[LocalFrame], grid: Grid, heights: FloatArray | float | None = None
) -> Coverage:
    """Maps of what a flight sees, one view after another; the result does not depend on their order.

    Parameters
    ----------
    views : of all images
    frames : look directions
    grid : of the maps; a few thousand cells a side at most
    heights : (rows, cols) or one height of the ground, world metres; the views' lowest ground if None
    """
    direction = {name: frame.name for frame in frames for name in frame.images}
    count = np.zeros(grid.shape, np.int64)
    by_direction = {frame.name: np.zeros(grid.shape, np.int64) for frame in frames}
    walls = np.zeros((8, *grid.shape), np.int64)
    gsd = np.full(grid.shape, np.inf, np.float32)
    low = np.full((len(SPREAD_AXES), *grid.shape), np.inf, np.float32)
    high = -low
    for view in views:
        rows, cols, xyz = _cells_seen(view, grid, heights)
        if len(rows) == 0:
            continue
        ray = view.image.centre - xyz
        far = np.linalg.norm(ray, axis=1)
        ray /= far[:, None]
        count[rows, cols] += 1
        if view.name in direction:
            by_direction[direction[view.name]][rows, cols] += 1
        facing = WALL_NORMALS @ ray[:, :2].T
        walls[:, rows, cols] += facing > np.cos(np.radians(STEEPEST_INCIDENCE_DEG))
        camera = view.image.camera
        gsd[rows, cols] = np.minimum(gsd[rows, cols], far / np.sqrt(camera.fx * camera.fy))
        along = SPREAD_AXES @ ray.T
        low[:, rows, cols] = np.minimum(low[:, rows, cols], along)
        high[:, rows, cols] = np.maximum(high[:, rows, cols], along)
    spread = np.where(count > 0, (high - low).max(axis=0, initial=0.0, where=count > 0), np.nan)
    angle = np.degrees(2 * np.arcsin(np.clip(spread / 2, 0, 1))).astype(np.float32)
    gsd[count == 0] = np.nan
    return Coverage(grid, count, by_direction, walls, gsd, angle, _alone(views))


def _cells_seen(view: View, grid: Grid, heights: FloatArray | float | None) -> tuple[IntArray, IntArray, FloatArray]:
    """Rows and columns of the cells whose centres lie in an image, and their (n, 3) world points."""
    level = view.heights[0] if heights is None else float(np.nanmin(heights))
    ground = footprint(view, level)
    nothing = np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 3))
    if ground.is_empty:
        return nothing
    x_min, y_min, x_max, y_max = ground.bounds
    (row_0, row_1), (col_0, col_1) = grid.indices(np.array([x_min, x_max]), np.array([y_max, y_min]))
    rows = np.arange(max(row_0, 0), min(row_1, grid.rows - 1) + 1)
    cols = np.arange(max(col_0, 0), min(col_1, grid.cols - 1) + 1)
    if len(rows) == 0 or len(cols) == 0:
        return nothing
    x, y = np.meshgrid(grid.x_centres()[cols], grid.y_centres()[rows])
    z = heights[np.ix_(rows, cols)] if isinstance(heights, np.ndarray) else np.full(x.shape, level)
    xyz = np.stack([x, y, z], axis=-1)
    # the footprint is cut at a bounded distance, the image is not
    seen = sees(view.image, xyz) & shapely.contains_xy(ground.buffer(grid.cell), x, y)
    r, c = np.nonzero(seen)
    return rows[r], cols[c], xyz[r, c]


def _alone(views: Sequence[View]) -> tuple[str, ...]:
    ground = [footprint(view) for view in views]
    tree, met = shapely.STRtree(ground), set[int]()
    for start in range(0, len(ground), PAIRS_AT_ONCE):
        one, other = tree.query(ground[start : start + PAIRS_AT_ONCE], predicate="intersects")
        met.update((one[one + start != other] + start).tolist())
    return tuple(sorted(view.name for k, view in enumerate(views) if k not in met))


def wall_name(direction: int) -> str:
    """Which walls a layer of `Coverage.walls` is of.

    >>> wall_name(6)
    'west'
    """
    return COMPASS[direction]
