"""Edges of found outlines that stand where the survey ends: no wall was seen to end there, nor a roof."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from cityflow.core.building import Outline, OutlineEdge
from cityflow.outlines.from_heights.regions import RegionSurface

ENDS = "ends where the survey ends"
"""Remark of such outlines."""
BEYOND_CELLS = 2.0
"""What lies so far outside an edge is unknown where the survey ends at it, cells: the edge is drawn along cells, and straightened."""
LEAST_SHARE = 0.5
"""Of the edge's length: the most of it."""


def marked(outline: Outline, surface: RegionSurface) -> Outline:
    """The outline with what is known of its edges (all rings, the inside on the left): of those at the survey's end, nothing tells how exact they are.

    Edges along which façades were seen are walls wherever they stand.
    """
    cut = [e.source != "wall" and _at_end(e, surface) for e in outline.edges]
    if not any(cut):
        return outline
    edges = tuple(replace(e, sigma_m=float("nan")) if c else e for e, c in zip(outline.edges, cut, strict=True))
    return replace(outline, edges=edges, remark="; ".join(filter(None, [outline.remark, ENDS])))


def _at_end(edge: OutlineEdge, surface: RegionSurface) -> bool:
    grid = surface.grid
    a, b = shapely.get_coordinates(edge.line)
    d = (b - a) / max(float(np.hypot(*(b - a))), 1e-9)
    along = np.arange(0.5, max(round(edge.line.length / grid.cell), 1)) * grid.cell
    places = a + along[:, None] * d + BEYOND_CELLS * grid.cell * np.array([d[1], -d[0]])
    row, col = grid.indices(places[:, 0], places[:, 1])
    inside = (row >= 0) & (col >= 0) & (row < grid.rows) & (col < grid.cols)
    # beyond the raster is another tile, not the end of the survey
    unknown = np.isnan(surface.ndsm[row[inside], col[inside]])
    return bool(unknown.sum() >= LEAST_SHARE * len(along))
