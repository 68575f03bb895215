"""The part of each local frame's rasters that an outline with its façades covers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters


def evidence_window(
    frames: Sequence[FrameRasters], outline: Polygon, z_range: tuple[float, float], margin: float = 2.0
) -> tuple[FrameRasters, ...]:
    """Views into the rasters over `outline` between two heights; local frames that do not reach it are left out.

    Parameters
    ----------
    frames : rasters of larger areas
    outline : world metres
    z_range : ground and highest roof, world metres
    margin : metres around
    """
    cut = (_cut(f, window_grid(f.frame, f.grid, outline, z_range, margin)) for f in frames)
    return tuple(f for f in cut if f is not None)


def window_grid(
    frame: LocalFrame, grid: Grid, outline: Polygon, z_range: tuple[float, float], margin: float = 2.0
) -> Grid | None:
    """The part of `grid` that `outline` between two heights falls on, or None where it misses the grid."""
    corners = np.concatenate([_ring_at(outline, z, frame) for z in z_range])
    low, high = corners[:, :2].min(axis=0) - margin, corners[:, :2].max(axis=0) + margin
    rows, cols = grid.indices(np.array([low[0], high[0]]), np.array([high[1], low[1]]))
    row_0, row_1 = max(int(rows[0]), 0), min(int(rows[1]) + 1, grid.rows)
    col_0, col_1 = max(int(cols[0]), 0), min(int(cols[1]) + 1, grid.cols)
    if row_1 <= row_0 or col_1 <= col_0:
        return None
    return Grid(grid.x_min + col_0 * grid.cell, grid.y_max - row_0 * grid.cell, grid.cell, row_1 - row_0, col_1 - col_0)


def covered(raster: FrameRasters, outline: Polygon, z_range: tuple[float, float], grow: float) -> BoolArray:
    """(rows, cols) cells of a local frame on which the upright prism over `outline`, grown by `grow` metres, falls."""
    grid = raster.grid
    polygon = outline.buffer(grow, join_style="mitre").simplify(grid.cell)
    mask = np.zeros(grid.shape, np.uint8)
    for part in shapely.get_parts(polygon):
        low, high = (_cells(_ring_at(part, z, raster.frame), grid) for z in z_range)
        sides = np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1)
        for quad in sides:
            cv2.fillConvexPoly(mask, np.round(quad).astype(np.int32), 1)
        for ring in (low, high):
            cv2.fillPoly(mask, [np.round(ring).astype(np.int32)], 1)
    return mask.astype(bool)


def _ring_at(outline: Polygon, z: float, frame: LocalFrame) -> FloatArray:
    """(n, 3) local frame coordinates of the exterior ring at a height."""
    xy = shapely.get_coordinates(outline.exterior)
    return frame.from_world(np.column_stack([xy, np.full(len(xy), z)]))


def _cells(xyz: FloatArray, grid: Grid) -> FloatArray:
    """Column and row, fractional, counted from the centre of the first cell."""
    return np.column_stack([(xyz[:, 0] - grid.x_min), (grid.y_max - xyz[:, 1])]) / grid.cell - 0.5


def _cut(raster: FrameRasters, part: Grid | None) -> FrameRasters | None:
    if part is None:
        return None
    row = round((raster.grid.y_max - part.y_max) / part.cell)
    col = round((part.x_min - raster.grid.x_min) / part.cell)
    window = (slice(row, row + part.rows), slice(col, col + part.cols))
    ortho = None if raster.ortho is None else raster.ortho[:, *window]
    seen = None if raster.seen is None else raster.seen[window]
    return FrameRasters(raster.frame, part, raster.dsm[window], ortho, seen)


def highest(raster: FrameRasters, outline: Polygon, ground_height: float) -> float:
    """World height below which nearly all of the nadir surface inside the outline lies, metres; a hundredth is noise.

    Parameters
    ----------
    raster : of the nadir frame
    """
    inside = covered(raster, outline, (ground_height, ground_height), 0.0)
    heights = raster.dsm[inside & np.isfinite(raster.dsm)]
    offset = float(raster.frame.origin[2])
    top = offset + float(np.percentile(heights, 99.5)) if len(heights) else math.nan
    return top + 0.5 if top > ground_height else ground_height + 3.0
