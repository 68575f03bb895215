"""What splitting looks at for one outline, cut out of drawn frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import OutlineEdge
from cityflow.core.grid import Grid
from cityflow.core.splitting import FrameRasters, SplitEvidence
from scenes.drawn_frames import cut_rasters
from scenes.drawn_views import grid_over_shape

MARGIN_M = 2.0
EDGE_STEP_M = 0.5


def split_evidence(
    name: str,
    outline: Polygon,
    frames: Sequence[FrameRasters],
    terrain: tuple[Grid, FloatArray],
    inner_edges: tuple[OutlineEdge, ...] = (),
) -> SplitEvidence:
    """Rasters of every local frame over an outline and `MARGIN_M` around it, from the lowest terrain to the highest surface.

    Parameters
    ----------
    frames : over the whole town, the nadir first
    terrain : grid (world) and heights
    """
    low = float(np.nanmin(_along(outline, *terrain)))
    around = shapely.buffer(shapely.envelope(outline), MARGIN_M, join_style="mitre")
    nadir = _over(frames[0], around, (low, low))
    heights = low - 1.0, float(np.nanmax(nadir.dsm)) + 1.0 if np.isfinite(nadir.dsm).any() else low + 10.0
    close = shapely.buffer(shapely.convex_hull(outline), MARGIN_M, join_style="mitre")
    cut = tuple(_over(f, close, heights) for f in frames[1:])
    return SplitEvidence(name, outline, (nadir, *cut), low, None, inner_edges)


def _along(outline: Polygon, grid: Grid, heights: FloatArray) -> FloatArray:
    x, y = shapely.get_coordinates(shapely.segmentize(outline.exterior, EDGE_STEP_M)).T
    row, col = grid.indices(x, y)
    return np.asarray(heights[np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)])


def _over(rasters: FrameRasters, shape: shapely.Geometry, heights: tuple[float, float]) -> FrameRasters:
    wanted, whole = grid_over_shape(rasters.frame, shape, heights, rasters.grid.cell), rasters.grid
    top, left = round((whole.y_max - wanted.y_max) / whole.cell), round((wanted.x_min - whole.x_min) / whole.cell)
    row, col = max(top, 0), max(left, 0)
    rows, cols = min(top + wanted.rows, whole.rows) - row, min(left + wanted.cols, whole.cols) - col
    part = Grid(whole.x_min + col * whole.cell, whole.y_max - row * whole.cell, whole.cell, max(rows, 1), max(cols, 1))
    return cut_rasters(rasters, part)
