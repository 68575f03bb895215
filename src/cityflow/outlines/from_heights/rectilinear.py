"""Outline of a region by rectangles: turn, approximate (§2.3), generalise (§2.4), move each edge to its points."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.outlines.from_heights.generalise import alternating_offsets, corners_of, without_short_edges
from cityflow.outlines.from_heights.rectangles import rectangle_approximation
from cityflow.outlines.from_heights.refit import edge_directions, refitted
from cityflow.outlines.from_heights.regions import Region, cells_polygon


def rectilinear_rings(
    region: Region, orientation: float, points: FloatArray, shortest_m: float, quality_m2: float
) -> list[FloatArray]:
    """Rings (n, 2) with right angles only, the exterior first, world metres.

    Parameters
    ----------
    region : Region
    orientation : radians, of one family of edges
    points : (m, 2) boundary points of the region
    shortest_m : shorter edges are removed
    quality_m2 : parts of the region or around it that are smaller than this need not be followed
    """
    turned, grid, origin = _turned(region, orientation)
    approximation = rectangle_approximation(turned, quality_m2 / grid.cell**2)
    polygon = cells_polygon(approximation, grid)
    rings = [_true_corners(shapely.get_coordinates(r)[:-1]) for r in (polygon.exterior, *polygon.interiors)]
    local = _rotated(points - origin, -orientation)
    result = []
    for number, ring in enumerate(rings):
        general = corners_of(without_short_edges(alternating_offsets(ring), shortest_m))
        if number == 0 or Polygon(general).area >= shortest_m**2:
            moved = refitted(general, edge_directions(general), local, reach_m=shortest_m)
            result.append(_rotated(moved, orientation) + origin)
    return result


def _turned(region: Region, orientation: float) -> tuple[BoolArray, Grid, FloatArray]:
    """The region resampled in a frame turned by the orientation, at half its cell; the frame's origin in the world."""
    grid = region.grid
    origin = np.array([grid.x_min, grid.y_max])
    x_min, y_min, x_max, y_max = grid.bounds
    corners = np.array([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])
    u, v = _rotated(corners - origin, -orientation).T
    turned = Grid.covering((u.min(), v.min(), u.max(), v.max()), grid.cell / 2)
    uu, vv = turned.centres()
    world = _rotated(np.column_stack([uu.ravel(), vv.ravel()]), orientation) + origin
    row, col = grid.indices(world[:, 0], world[:, 1])
    inside = (row >= 0) & (col >= 0) & (row < grid.rows) & (col < grid.cols)
    mask = np.zeros(len(world), bool)
    mask[inside] = region.mask[row[inside], col[inside]]
    return mask.reshape(turned.shape), turned, origin


def _rotated(points: FloatArray, angle: float) -> FloatArray:
    """(n, 2) turned counter-clockwise by the angle (radians) about (0, 0)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[c, s], [-s, c]]))


def _true_corners(ring: FloatArray) -> FloatArray:
    """A ring with axis-parallel sides without the vertices along them."""
    ahead, behind = np.roll(ring, -1, axis=0) - ring, ring - np.roll(ring, 1, axis=0)
    return np.asarray(ring[np.abs(ahead[:, 0] * behind[:, 1] - ahead[:, 1] * behind[:, 0]) > 1e-9])
