"""A terrain of few triangles: a regular mesh over a TIN, whose border it follows."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds

CELLS = 24
"""Of the longer side: 1,152 triangles."""


def coarse_ground(
    vertices: FloatArray, triangles: IntArray, bounds: Bounds, cells: int = CELLS
) -> tuple[FloatArray, IntArray]:
    """(V, 3) and (T, 3) of a regular mesh with the heights of a TIN; nodes just beyond its border stand on its nearest vertex.

    Parameters
    ----------
    vertices, triangles : (V, 3) world metres and (T, 3)
    bounds : of the mesh;  cells : of its longer side
    """
    if not len(triangles):
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    x_0, y_0, x_1, y_1 = bounds
    cell = max(x_1 - x_0, y_1 - y_0) / cells
    cols, rows = (max(round(length / cell), 1) for length in (x_1 - x_0, y_1 - y_0))
    x, y = np.meshgrid(np.linspace(x_0, x_1, cols + 1), np.linspace(y_0, y_1, rows + 1))
    xy = np.column_stack([x.ravel(), y.ravel()])
    nodes = np.column_stack([xy, heights_at(vertices, triangles, xy)])
    outside = np.flatnonzero(np.isnan(nodes[:, 2]))
    border = vertices[np.unique(triangles)]
    away, nearest = cKDTree(border[:, :2]).query(xy[outside], distance_upper_bound=2**0.5 * cell)
    moved = np.isfinite(away)
    nodes[outside[moved]] = border[nearest[moved]]
    lower = (np.arange(rows)[:, None] * (cols + 1) + np.arange(cols)).ravel()
    upper = lower + cols + 1
    mesh = np.concatenate([np.column_stack([lower, lower + 1, upper]), np.column_stack([lower + 1, upper + 1, upper])])
    a, b, c = (nodes[mesh[:, i], :2] for i in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    # where the border is hollow, nodes that moved onto it would turn triangles over
    mesh = mesh[np.isfinite(nodes[mesh, 2]).all(axis=1) & (area > 1e-3 * cell**2)]
    used, mesh = np.unique(mesh, return_inverse=True)
    return nodes[used], mesh.reshape(-1, 3).astype(np.int64)


def heights_at(vertices: FloatArray, triangles: IntArray, xy: FloatArray) -> FloatArray:
    """(N,) heights of a TIN at (N, 2) places; NaN beside it."""
    found = np.full(len(xy), np.nan)
    if not len(triangles) or not len(xy):
        return found
    corners = vertices[triangles]
    tree = shapely.STRtree(shapely.polygons(corners[:, [0, 1, 2, 0], :2]))
    places, hits = tree.query(shapely.points(xy), predicate="intersects")
    order = np.lexsort((hits, places))
    places, first = np.unique(places[order], return_index=True)
    a, b, c = (corners[hits[order][first], i] for i in range(3))
    p = xy[places]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    v = ((p[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1])) / area
    w = ((b[:, 0] - a[:, 0]) * (p[:, 1] - a[:, 1]) - (p[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])) / area
    found[places] = a[:, 2] + v * (b[:, 2] - a[:, 2]) + w * (c[:, 2] - a[:, 2])
    return found
