"""Steps of a surface within a roof where the model has none: flanks of dormers and edges of parts that it lacks, or has elsewhere."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.reconstruction import HeightRaster
from cityflow.geometry.roof_distances import roof_hits

STEEP, SLOPING = 1.5, 1.2
"""Slopes: a surface above the first is a step, a roof below the second has none there; set by hand."""
RIM_CELLS = 3.0
"""Nearer to the outline a surface falls anyway, cells; set by hand."""


def lacked_share(solid: Polyhedron, outline: Polygon, heights: HeightRaster) -> float:
    """Share of a roof without its rim where the surface is as steep as a step, or unknown, and the model is not; 0 of a roof that is all rim."""
    cell = heights.grid.cell
    x, y = heights.grid.centres()
    inner = shapely.buffer(outline, -RIM_CELLS * cell)
    shapely.prepare(inner)
    inside = shapely.contains_xy(inner, x, y)
    if not inside.any():
        return 0.0
    down, across = np.gradient(heights.dsm, cell)
    steep = inside & ~(np.hypot(down, across) <= STEEP)
    slope = _slope_of(solid, np.column_stack([x[steep], y[steep]]), cell)
    return float(np.sum(slope < SLOPING) / inside.sum())


def _slope_of(solid: Polyhedron, xy: FloatArray, cell: float) -> FloatArray:
    """(N,) slope of a model at places, over two cells as that of the surface; NaN beyond it."""
    apart = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]) * cell
    spots = (xy[:, None] + apart).reshape(-1, 2)
    below = roof_hits(solid, np.column_stack([spots, np.zeros(len(spots))]))[1].reshape(-1, 4)
    return np.asarray(np.hypot(below[:, 0] - below[:, 1], below[:, 2] - below[:, 3]) / (2 * cell))
