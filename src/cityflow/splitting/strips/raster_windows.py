"""The cells of a local frame's rasters that an outline with its façades covers."""

from __future__ import annotations

import math

import cv2
import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters


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
